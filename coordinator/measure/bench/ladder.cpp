#include "coordinator/measure/bench/ladder.h"

#include <charconv>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

std::vector<std::string> parts_of(const std::string& list) {
  std::vector<std::string> out;
  for (size_t at = 0; at <= list.size();) {
    const size_t end = std::min(list.find(',', at), list.size());
    out.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

tl::unexpected<Error> refuse(const std::string& given, const std::string& why) {
  return fail(ErrorKind::kUsage, text("--set {}: {}: NAME:key=value,key=value is expected, with settings as "
                                      "'kiln bake --help' lists them "
                                      "and ladder=error or ladder=samples",
                                      given, why));
}

Configuration known(const std::string& text) {
  const auto c = parse_configuration(text);
  KILN_CHECK(c.has_value());
  return *c;
}

}  // namespace

Expected<Configuration> parse_configuration(const std::string& given) {
  const size_t colon = given.find(':');
  Configuration c;
  c.name = given.substr(0, colon);
  if (c.name.empty()) return refuse(given, "there is no name");
  for (const char letter : c.name)
    if (!std::isalnum(static_cast<unsigned char>(letter)) && letter != '-' && letter != '_')
      return refuse(given, "a name has letters, digits, '-' and '_'");
  if (colon == given.npos || colon + 1 == given.size()) return c;
  for (const std::string& part : parts_of(given.substr(colon + 1))) {
    const size_t equal = part.find('=');
    if (equal != part.npos) {
      c.settings.emplace_back(part.substr(0, equal), part.substr(equal + 1));
    } else if (c.settings.empty()) {
      return refuse(given, text("'{}' has no '='", part));
    } else {
      c.settings.back().second += "," + part;
    }
  }
  for (size_t i = 0; i < c.settings.size();) {
    if (c.settings[i].first != "ladder") {
      ++i;
      continue;
    }
    const std::string kind = c.settings[i].second;
    if (kind != "samples" && kind != "error") return refuse(given, text("there is no ladder '{}'", kind));
    c.by_samples = kind == "samples";
    c.settings.erase(c.settings.begin() + static_cast<ptrdiff_t>(i));
  }
  BakeSettings check;
  for (const auto& [key, value] : c.settings)
    if (const Status s = set_option(check, key, value, ""); !s) return refuse(given, s.error().message);
  return c;
}

std::vector<Configuration> default_configurations() {
  return {known("brute:ladder=samples,sampler=halton,cache=off,denoise=off"),
          known("owen:sampler=owen,cache=off,denoise=off"), known("cache:cache=on,denoise=off"),
          known("denoise:cache=on,denoise=on")};
}

Expected<std::vector<double>> parse_budgets(const std::string& name, const std::string& list) {
  std::vector<double> out;
  for (const std::string& part : parts_of(list)) {
    double value = 0;
    const auto [end, code] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (code != std::errc() || end != part.data() + part.size() || !(value > 0) || !std::isfinite(value))
      return fail(ErrorKind::kUsage, text("--{} {}: '{}' is no number above 0", name, list, part));
    out.push_back(value);
  }
  return out;
}

Expected<BakeSettings> settings_of_run(const BakeSettings& base, const Configuration& configuration,
                                       double budget, uint32_t repeat) {
  BakeSettings s = base;
  const auto unless_said = [&](const char* name, const char* value) -> Status {
    return s.source.count(name) ? Status{} : set_option(s, name, value, "kiln bench");
  };
  KILN_TRY_STATUS(unless_said("basis", "irradiance"));
  KILN_TRY_STATUS(unless_said("encode", "none"));
  KILN_TRY_STATUS(unless_said("seams", "off"));
  KILN_TRY_STATUS(unless_said("dilate", "0"));
  KILN_TRY_STATUS(unless_said("error-norm", "mean-square"));  // the norm that relMSE measures
  for (const auto& [key, value] : configuration.settings)
    KILN_TRY_STATUS(set_option(s, key, value, "--set " + configuration.name));
  if (configuration.by_samples) {
    KILN_TRY_STATUS(set_option(s, "max-samples", text("{:.0f}", budget), "kiln bench"));
    s.min_samples = s.max_samples;
  } else {
    KILN_TRY_STATUS(set_option(s, "error", text("{}", budget), "kiln bench"));
  }
  s.seed += repeat;
  KILN_TRY_STATUS(check_settings(s));
  return s;
}

std::string budget_text(const Configuration& configuration, double budget) {
  return configuration.by_samples ? text("{:.0f} samples", budget) : text("error {:g}", budget);
}

}  // namespace kiln
