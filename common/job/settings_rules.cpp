// Setting an option by its name, and rules between settings. Each error names the settings and the way out.
#include <algorithm>
#include <charconv>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/job/settings.h"

namespace kiln {
namespace {

Status refuse(std::string why) {
  return fail(ErrorKind::kUsage, std::move(why));
}

// A wish about scene.glb that needs light in the map; defaults do without.
Status check_lit_scene(const BakeSettings& b) {
  if (b.source.contains("lamps") && b.lamps != "keep" && !has_direct_light(b))
    return refuse(
        text("--lamps {} is for lamps that are in the map, and with {} none is: use --lamps keep, or "
             "{}",
             b.lamps,
             b.quantities.light ? "--components indirect" : "--quantities " + print_quantities(b.quantities),
             b.quantities.light ? "bake direct light too" : "add light to --quantities"));
  if (b.source.contains("embed-basecolor") && b.embed_basecolor && !b.quantities.light)
    return refuse(
        text("--embed-basecolor on draws light into textures, and --quantities {} bakes none: leave "
             "it off, or add light",
             print_quantities(b.quantities)));
  return {};
}

}  // namespace

Status check_settings(const BakeSettings& b) {
  KILN_TRY_STATUS(find_basis(b.basis, b.sh_fit, b.sh_evaluator));
  KILN_TRY_STATUS(check_lit_scene(b));
  if (b.two_pass && !b.quantities.responses.empty())
    return refuse(
        text("--two-pass on takes texels from charts by their light alone, and {} would lose them too: leave "
             "it off, "
             "or bake light by itself",
             response_roster()[b.quantities.responses.front()].name));
  if (b.split && !(b.quantities.light && b.direct && b.indirect))
    return refuse(text(
        "--split direct,indirect writes both parts of the light, and with {} they are not both baked: leave "
        "out one of the two settings",
        b.quantities.light ? text("--components {}", b.direct ? "direct" : "indirect")
                           : "--quantities " + print_quantities(b.quantities)));
  if (b.probes == "off" && b.probes_asked)
    return refuse("--quantities asks for probes and --probes off for none: leave one of them out");
  if (b.probe_max_spacing != 0 && b.probe_max_spacing < b.probe_spacing)
    return refuse(
        text("--probe-max-spacing {:g} is below --probe-spacing {:g}", b.probe_max_spacing, b.probe_spacing));
  if (b.min_samples > b.max_samples)
    return refuse(text("--min-samples {} is above --max-samples {}", b.min_samples, b.max_samples));
  const bool astc = std::any_of(b.encodings.begin(), b.encodings.end(),
                                [](const std::string& name) { return name.starts_with("astc"); });
  if (astc && !b.ktx2) return refuse("DDS files do not hold ASTC: --encode astc-... takes --container ktx2");
  return {};
}

uint32_t BakeSettings::least_samples(uint64_t texels, bool cached) const {
  // In a large map many texels lie under even light and need few, and the denoiser sees a hundred of them
  // together. docs/performance.md, "Tried in a furnished room".
  constexpr uint64_t kManyTexels = 1u << 17;
  constexpr uint32_t kFewSamples = 16;
  const bool together = quantities.light && cached && denoise && error_norm == "mean-square";
  if (texels < kManyTexels || !together || source.count("min-samples") > 0 || min_samples == max_samples)
    return min_samples;
  return std::min(min_samples, kFewSamples);
}

uint32_t BakeSettings::most_samples() const {
  return error_norm == "mean-square" ? max_samples : most_of_each();
}

uint32_t BakeSettings::most_of_each() const {
  constexpr uint32_t kMost = 16384;
  return source.count("max-samples") > 0 ? max_samples : std::min(max_samples, std::max(kMost, min_samples));
}

uint32_t basis_index(const BakeSettings& b) {
  const Expected<uint32_t> index = find_basis(b.basis, b.sh_fit, b.sh_evaluator);
  KILN_CHECK(index.has_value());  // parsers accept what the roster has
  return *index;
}

const BasisInfo& basis_of(const BakeSettings& b) {
  return basis_roster()[basis_index(b)];
}

Status set_option(BakeSettings& settings, const std::string& name, const std::string& value,
                  const std::string& source) {
  for (const Setting& row : settings_table()) {
    if (name != row.name) continue;
    if (Status s = row.parse(settings, value); !s)
      return fail(ErrorKind::kUsage, text("--{} {}: {}", name, value, s.error().message));
    settings.source[name] = source;
    return {};
  }
  return fail(ErrorKind::kUsage, text("there is no setting '{}': 'kiln bake --help' lists them", name));
}

std::optional<std::vector<double>> parse_radiance(const std::string& value) {
  std::vector<double> out;
  const char* at = value.data();
  const char* const end = at + value.size();
  while (out.size() < 3) {
    double number;
    const auto [next, code] = std::from_chars(at, end, number);
    if (code != std::errc()) return std::nullopt;
    out.push_back(number);
    at = next;
    if (out.size() < 3 && (at == end || *at++ != ',')) return std::nullopt;
  }
  return at == end ? std::optional(out) : std::nullopt;
}

}  // namespace kiln
