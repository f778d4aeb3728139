#include "common/job/values.h"

#include <algorithm>
#include <charconv>

namespace kiln::values {

Expected<double> number(const std::string& s) {
  double v = 0;
  const auto [end, code] = std::from_chars(s.data(), s.data() + s.size(), v);
  if (code != std::errc() || end != s.data() + s.size() || !std::isfinite(v))
    return fail(ErrorKind::kUsage, text("'{}' is not a number", s));
  return v;
}

Expected<std::vector<double>> numbers(std::string_view s) {
  std::vector<double> out;
  while (true) {
    const size_t comma = s.find(',');
    KILN_TRY(const double v, number(std::string(s.substr(0, comma))));
    out.push_back(v);
    if (comma == s.npos) return out;
    s.remove_prefix(comma + 1);
  }
}

Status store_share(double& target, const std::string& s, double low, double high) {
  const bool is_percent = s.ends_with('%');
  KILN_TRY(double v, number(is_percent ? s.substr(0, s.size() - 1) : s));
  if (is_percent) v /= 100;
  if (!is_percent && v > 1 && v <= 100)
    return refuse(
        text("is that {0} % or {0} times as much? Write {0}% for the one, {1}% for the other", s, 100 * v));
  if (!(v >= low && v <= high)) return refuse(text("{} is outside {} to {}", s, low, high));
  target = v;
  return {};
}

Status store_duration(double& target, const std::string& s, double high) {
  constexpr std::pair<char, double> kUnits[] = {{'s', 1}, {'m', 60}, {'h', 3600}};
  double total = 0, last = 1e9;  // units get smaller
  for (size_t at = 0; at < s.size();) {
    const size_t end = std::min(s.find_first_of("smh", at), s.size());
    KILN_TRY(const double v, number(s.substr(at, end - at)));
    double unit = 1;
    for (const auto& [letter, seconds] : kUnits)
      if (end < s.size() && s[end] == letter) unit = seconds;
    if (v < 0 || unit >= last || (end == s.size() && at > 0))
      return refuse(text("'{}' is no time: write 90, 90s, 1.5m or 1h30m", s));
    total += v * unit;
    last = unit;
    at = end + 1;
  }
  if (s.empty() || total > high) return refuse(text("'{}' is no time from 0 to {} seconds", s, high));
  target = total;
  return {};
}

Status store_word(std::string& target, const std::string& s, std::initializer_list<const char*> words) {
  std::string all;
  for (const char* word : words) {
    if (s == word) {
      target = s;
      return {};
    }
    all += (all.empty() ? "" : ", ") + std::string(word);
  }
  return refuse(text("'{}' is not one of {}", s, all));
}

Status store_switch(bool& field, const std::string& s) {
  std::string word;
  KILN_TRY_STATUS(store_word(word, s, {"on", "off"}));
  field = word == "on";
  return {};
}

std::string print_switch(bool on) {
  return on ? "on" : "off";
}

Status store_flags(const std::string& s, std::initializer_list<std::pair<const char*, bool*>> flags) {
  const std::vector<std::string> given = s == "none" ? std::vector<std::string>{} : words(s);
  std::string known;
  for (const auto& [name, flag] : flags) known += std::string(name) + ", ";
  for (const std::string& word : given)
    if (std::none_of(flags.begin(), flags.end(), [&](const auto& f) { return word == f.first; }))
      return refuse(text("'{}' is not one of {}or none alone", word, known));
  for (const auto& [name, flag] : flags) *flag = std::find(given.begin(), given.end(), name) != given.end();
  return {};
}

std::string print_flags(std::initializer_list<std::pair<const char*, bool>> flags) {
  std::vector<std::string> on;
  for (const auto& [name, flag] : flags)
    if (flag) on.emplace_back(name);
  return on.empty() ? "none" : joined(on);
}

std::vector<std::string> words(const std::string& s) {
  std::vector<std::string> out;
  for (size_t at = 0; at <= s.size();) {
    const size_t end = std::min(s.find(',', at), s.size());
    out.push_back(s.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

std::string joined(std::span<const std::string> list) {
  std::string out;
  for (const std::string& word : list) out += (out.empty() ? "" : ",") + word;
  return out;
}

std::string print(double v) {
  return text("{}", v);
}

std::string print_share(double v) {
  return v > 1 ? text("{}%", 100 * v) : print(v);
}

}  // namespace kiln::values
