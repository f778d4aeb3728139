// Little-endian byte streams for chunks and blocks. A reader checks every size before it allocates.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/status.h"

namespace kiln {

static_assert(std::endian::native == std::endian::little, "stored formats are little-endian");

using Bytes = std::vector<std::byte>;

inline std::span<const std::byte> bytes_of(std::string_view s) {
  return {reinterpret_cast<const std::byte*>(s.data()), s.size()};
}
template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& v) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span<const T>(v));
}

class ByteWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* p = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), p, p + sizeof(T));
  }
  // u64 count, then the elements.
  template <class T>
  void put_array(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    put<uint64_t>(values.size());
    const auto* p = reinterpret_cast<const std::byte*>(values.data());
    bytes_.insert(bytes_.end(), p, p + values.size() * sizeof(T));
  }
  void put_string(std::string_view s) {
    put<uint64_t>(s.size());
    const auto* p = reinterpret_cast<const std::byte*>(s.data());
    bytes_.insert(bytes_.end(), p, p + s.size());
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

// After the first short or oversized read every further read yields zero and ok() is false.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> data) : data_(data) {}
  template <class T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    if (need(sizeof(T))) {
      std::memcpy(&value, data_.data(), sizeof(T));
      data_ = data_.subspan(sizeof(T));
    }
    return value;
  }
  template <class T>
  std::vector<T> get_array() {
    const uint64_t count = get<uint64_t>();
    std::vector<T> values;
    if (count > data_.size() / sizeof(T) || !ok_) {
      ok_ = false;
      return values;
    }
    values.resize(count);
    if (count) std::memcpy(values.data(), data_.data(), count * sizeof(T));
    data_ = data_.subspan(count * sizeof(T));
    return values;
  }
  std::string get_string() {
    const uint64_t count = get<uint64_t>();
    if (count > data_.size() || !ok_) {
      ok_ = false;
      return {};
    }
    std::string s(reinterpret_cast<const char*>(data_.data()), count);
    data_ = data_.subspan(count);
    return s;
  }
  // Reads a count of elements that follow, each at least `least_bytes` long; 0 if too few bytes are left.
  uint64_t get_count(size_t least_bytes) {
    const uint64_t count = get<uint64_t>();
    if (count > data_.size() / least_bytes) ok_ = false;
    return ok_ ? count : 0;
  }
  bool ok() const { return ok_; }
  bool at_end() const { return ok_ && data_.empty(); }

 private:
  bool need(size_t size) {
    if (!ok_ || data_.size() < size) ok_ = false;
    return ok_;
  }
  std::span<const std::byte> data_;
  bool ok_ = true;
};

}  // namespace kiln
