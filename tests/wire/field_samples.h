// Values of any described struct, made from its description (common/base/fields.h): whatever its own check
// accepts. The same seed draws the same value.
#pragma once

#include <random>

#include "common/base/fields.h"

namespace kiln::test {

class FieldSampler {
 public:
  explicit FieldSampler(uint64_t seed) : random_(seed) {}
  void operator()(auto&&... fields) { (fill(fields), ...); }

 private:
  // Small numbers, so that sizes which must agree often do.
  uint64_t draw(uint64_t below) { return random_() % below; }
  template <class T>
  void fill(T& f) {
    if constexpr (std::is_same_v<T, std::byte>)
      f = static_cast<std::byte>(random_());
    else if constexpr (std::is_same_v<T, bool>)
      f = draw(2) != 0;
    else if constexpr (std::is_enum_v<T>)
      f = static_cast<T>(draw(EnumField<T>::kCount));
    else if constexpr (std::is_same_v<T, Digest>)
      for (uint8_t& byte : f.bytes) byte = static_cast<uint8_t>(random_());
    else if constexpr (std::is_floating_point_v<T>)
      f = static_cast<T>(draw(9)) - T(1.5);
    else if constexpr (std::is_integral_v<T>)
      f = static_cast<T>(draw(5));
    else if constexpr (Described<T>)
      T::fields(f, *this);
    else
      f.parts(*this);
  }
  void fill(std::string& f) {
    f.resize(draw(12));
    for (char& c : f) c = static_cast<char>('a' + draw(26));
  }
  template <class T>
  void fill(std::vector<T>& f) {
    f.resize(draw(7));
    for (T& element : f) fill(element);
  }
  template <class T>
  void fill(AtMost<T>& f) {
    fill(f.field);
  }
  std::mt19937_64 random_;
};

// Draws until what is written is read again: a struct's fault() refuses some draws.
template <Described T>
T sample(uint64_t seed) {
  for (;; seed += 0x9e3779b97f4a7c15u) {
    T value;
    FieldSampler draw(seed);
    T::fields(value, draw);
    if (read_fields<T>(write_fields(value), ErrorKind::kInternal, "sample")) return value;
  }
}

}  // namespace kiln::test
