// Values of settings as text: read into fields, with errors that say what is allowed (kUsage), and printed as
// they are read.
#pragma once

#include <cmath>
#include <initializer_list>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/format.h"
#include "common/base/status.h"

namespace kiln::values {

inline Status refuse(std::string why) {
  return fail(ErrorKind::kUsage, std::move(why));
}

Expected<double> number(const std::string& s);
Expected<std::vector<double>> numbers(std::string_view s);  // separated by commas

// `T`: a floating-point or an integer type, which takes whole numbers only.
template <class T>
Status store_number(T& target, const std::string& s, double low, double high) {
  KILN_TRY(const double v, number(s));
  if (v < low || v > high) return refuse(text("{} is outside {} to {}", s, low, high));
  if constexpr (std::is_integral_v<T>) {
    if (v != std::floor(v)) return refuse(text("{} is not a whole number", s));
  }
  target = static_cast<T>(v);
  return {};
}

// A share: "0.05" or "5%". Above 1 only with the sign, as a bare 5 may be either.
Status store_share(double& target, const std::string& s, double low, double high);
// Seconds: "90", "90s", "1.5m", "1h30m".
Status store_duration(double& target, const std::string& s, double high);
Status store_word(std::string& target, const std::string& s, std::initializer_list<const char*> words);
// "on" or "off".
Status store_switch(bool& field, const std::string& s);

// A list of the names, which are then on and the others off; or "none".
Status store_flags(const std::string& s, std::initializer_list<std::pair<const char*, bool*>> flags);
std::string print_flags(std::initializer_list<std::pair<const char*, bool>> flags);

std::vector<std::string> words(const std::string& s);  // separated by commas
std::string joined(std::span<const std::string> list);

std::string print(double v);
// What store_share() reads as the same number.
std::string print_share(double v);
std::string print_switch(bool on);

}  // namespace kiln::values
