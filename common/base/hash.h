// SHA-256 where identity matters (chunks, results, outputs), XXH3 against damage in transit.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "common/base/status.h"

namespace kiln {

struct Digest {
  std::array<uint8_t, 32> bytes{};
  auto operator<=>(const Digest&) const = default;
  std::string hex() const;  // 64 lower-case digits
  static Expected<Digest> from_hex(std::string_view hex);
};

Digest sha256(std::span<const std::byte> data);
uint64_t xxh3(std::span<const std::byte> data);

// Incremental SHA-256.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  void add(std::span<const std::byte> data);
  Digest finish();  // once

 private:
  void* context_;
};

// Compares in constant time: the duration does not depend on where two secrets first differ.
bool equal_secret(std::string_view a, std::string_view b);
// `count` random bytes from the operating system, as hex. For tokens only, never for results.
std::string random_hex(size_t count);

}  // namespace kiln

template <>
struct std::hash<kiln::Digest> {
  size_t operator()(const kiln::Digest& d) const noexcept {
    size_t h;
    static_assert(sizeof h <= 32);
    __builtin_memcpy(&h, d.bytes.data(), sizeof h);
    return h;
  }
};
