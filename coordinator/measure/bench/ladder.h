// The configurations to measure: named sets of settings, each at a ladder of budgets.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/job/settings.h"

namespace kiln {

struct Configuration {
  std::string name;
  std::vector<std::pair<std::string, std::string>> settings;  // rows of settings_table
  bool by_samples = false;  // budgets are samples per texel; otherwise target errors
};

// Parses "NAME:key=value,key=value". A part without "=" continues the value before it (suns have commas). Key
// `ladder` is no setting: budgets are `samples`, equal for all texels, or `error` (default), the target.
Expected<Configuration> parse_configuration(const std::string& text);

// brute: Halton points and equal samples for all texels, as Flux bakes; owen: Kiln without its
// cache and denoiser; cache; denoise: both.
std::vector<Configuration> default_configurations();

// Parses "0.4,0.2,0.1": positive numbers, at least one; `name` is the option's, for messages.
Expected<std::vector<double>> parse_budgets(const std::string& name, const std::string& list);

// The settings of one run. Files that nobody reads are turned off: textures, a basis other than
// irradiance, joined seams and dilation, unless `base` sets them explicitly.
Expected<BakeSettings> settings_of_run(const BakeSettings& base, const Configuration& configuration,
                                       double budget, uint32_t repeat);

// "64 samples", "error 0.05".
std::string budget_text(const Configuration& configuration, double budget);

}  // namespace kiln
