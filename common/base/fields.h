// One description of a struct's fields, from which everything that depends on them is made: its bytes, the
// limits they are read with, its digest, its samples in tests.
//
//   struct Pace {
//     uint32_t heartbeat_ms = 0;
//     static void fields(auto& m, auto& v) { v(m.heartbeat_ms); }
//     const char* fault() const { return heartbeat_ms ? nullptr : "its interval is zero"; }  // optional
//   };
//
// Bytes are little-endian without padding: numbers as they are; bool and enum as one byte; text and arrays as
// a u64 count and their elements; a described struct as its fields. `at_most` bounds a text or an array, a
// text without it has kMaxTextBytes. A field with another form is a struct of references with
// put(ByteWriter&), get(FieldReader&) and parts(visitor).
#pragma once

#include <algorithm>

#include "common/base/bytes.h"
#include "common/base/hash.h"

namespace kiln {

constexpr size_t kMaxTextBytes =
    4096;  // of a text without a limit of its own; longer ones are cut when written

// Enumerators are 0 to kCount - 1. `kName` is for errors: "sampler 7 does not exist in this release".
template <class E>
struct EnumField;
template <>
struct EnumField<ErrorKind> {
  static constexpr const char* kName = "kind of error";
  static constexpr uint8_t kCount = static_cast<uint8_t>(ErrorKind::kTooShort) + 1;
};

// A text or array with a limit of its own, in elements. The writer does not cut it: its owner keeps to the
// limit.
template <class T>
struct AtMost {
  T& field;
  size_t limit;
};
template <class T>
AtMost<T> at_most(T& field, size_t limit) {
  return {field, limit};
}

struct AnyFields {
  void operator()(auto&&...) {}
};
template <class T>
concept Described = requires(T& m, AnyFields& v) {
  T::fields(m, v);
};

template <class T>
constexpr bool kIsRaw = std::is_integral_v<T> || std::is_floating_point_v<T> || std::is_same_v<T, Digest>;

class FieldWriter {
 public:
  // `room`: zero bytes in front, for a header.
  explicit FieldWriter(size_t room = 0) {
    for (size_t i = 0; i < room; ++i) bytes_.put(std::byte{});
  }
  void operator()(const auto&... fields) { (put(fields), ...); }
  Bytes take() { return bytes_.take(); }

 private:
  template <class T>
  void put(const T& f) {
    if constexpr (std::is_enum_v<T> || std::is_same_v<T, bool>)
      bytes_.put(static_cast<uint8_t>(f));
    else if constexpr (kIsRaw<T>)
      bytes_.put(f);
    else if constexpr (Described<T>)
      T::fields(f, *this);
    else
      f.put(bytes_);
  }
  void put(const std::string& f) { bytes_.put_string(std::string_view(f).substr(0, kMaxTextBytes)); }
  template <class T>
  void put(const std::vector<T>& f) {
    bytes_.put_array(f);
  }
  template <class T>
  void put(const AtMost<T>& f) {
    if constexpr (std::is_same_v<std::remove_const_t<T>, std::string>)
      bytes_.put_string(f.field);
    else
      bytes_.put_array(f.field);
  }
  ByteWriter bytes_;
};

// After the first fault nothing more is read and fields keep their values.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) : left_(bytes) {}
  void operator()(auto&&... fields) { (next(fields), ...); }
  // The next bytes, fewer than asked for only after a fault.
  std::span<const std::byte> take(uint64_t size);
  std::span<const std::byte> take_rest() { return take(fault_.empty() ? left_.size() : 0); }
  // Reads a u64 count of elements that follow and says whether it is within `limit` and they are there.
  uint64_t take_count(uint64_t limit, size_t element_bytes);
  void blame(std::string fault);  // "its ...", of the field that is read now
  bool ok() const { return fault_.empty(); }
  // Fails unless every byte was read and nothing was wrong: "a {what} is damaged: ...".
  Status finish(ErrorKind kind, std::string_view what) const;

 private:
  void next(auto& f) {
    if (!ok()) return;
    ++field_;
    get(f);
  }
  template <class T>
  void get(T& f) {
    if constexpr (std::is_same_v<T, bool>) {
      f = take_choice(2, "choice") != 0;
    } else if constexpr (std::is_enum_v<T>) {
      f = static_cast<T>(take_choice(EnumField<T>::kCount, EnumField<T>::kName));
    } else if constexpr (kIsRaw<T>) {
      if (const auto bytes = take(sizeof f); bytes.size() == sizeof f)
        std::memcpy(&f, bytes.data(), sizeof f);
    } else if constexpr (Described<T>) {
      T::fields(f, *this);
      if constexpr (requires { f.fault(); })
        if (const char* fault = ok() ? f.fault() : nullptr) blame(fault);
    } else {
      f.get(*this);
    }
  }
  void get(std::string& f) { get_array(f, kMaxTextBytes); }
  template <class T>
  void get(std::vector<T>& f) {
    get_array(f, std::numeric_limits<uint64_t>::max());
  }
  template <class T>
  void get(AtMost<T>& f) {
    get_array(f.field, f.limit);
  }
  template <class Array>
  void get_array(Array& f, uint64_t limit) {
    using T = typename Array::value_type;
    static_assert(std::is_trivially_copyable_v<T>);
    const uint64_t count = take_count(limit, sizeof(T));
    f.resize(count);
    if (count) std::memcpy(f.data(), take(count * sizeof(T)).data(), count * sizeof(T));
  }
  uint8_t take_choice(uint8_t count, const char* name);

  std::span<const std::byte> left_;
  uint32_t field_ = 0;
  std::string fault_;
};

// SHA-256 of a list of fields: whole numbers as u64, arrays as their elements.
class FieldDigest {
 public:
  void operator()(const auto&... fields) { (add(fields), ...); }
  Digest finish() { return hash_.finish(); }

 private:
  void add(std::integral auto value) {
    const uint64_t wide[] = {value};
    hash_.add(std::as_bytes(std::span(wide)));
  }
  template <class T>
  void add(const std::vector<T>& values) {
    hash_.add(bytes_of(values));
  }
  Sha256 hash_;
};

template <Described T>
Bytes write_fields(const T& value, size_t room = 0) {
  FieldWriter w(room);
  w(value);
  return w.take();
}

// `what` names it in errors: "stored result".
template <Described T>
Expected<T> read_fields(std::span<const std::byte> bytes, ErrorKind kind, std::string_view what) {
  Expected<T> value(tl::in_place);
  FieldReader r(bytes);
  r(*value);
  if (const Status s = r.finish(kind, what); !s) return fail(s.error().kind, s.error().message);
  return value;
}

}  // namespace kiln
