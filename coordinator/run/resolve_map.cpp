#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/clock.h"
#include "common/base/parallel.h"
#include "common/base/statistics.h"
#include "coordinator/bake/merge/response_errors.h"
#include "coordinator/bake/sampling/allocation.h"
#include "coordinator/bake/sampling/cache_draws.h"
#include "coordinator/run/bake_stages.h"
#include "coordinator/run/black_fronts.h"
#include "coordinator/run/statement.h"

namespace kiln {
namespace {

// The error plane of the map: the reported error of each texel.
void state_errors(Lightmap& map, const Atlas& atlas, const TexelErrors& errors) {
  std::vector<float>& plane = map.planes.plane("error");
  for (uint32_t site = 0; site < errors.standard_error.size(); ++site)
    if (std::isfinite(errors.standard_error[site]))
      plane[atlas.sites.texel[site]] = errors.standard_error[site];
}

void state_band_errors(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics,
                       std::span<const uint32_t> charts, const BasisInfo& basis,
                       std::span<const float> lowered, const TexelErrors& of_light) {
  map.band_error.width = map.planes.width;
  map.band_error.height = map.planes.height;
  for (const BasisBand& band : basis_bands(basis)) {
    std::vector<size_t> planes;
    for (const size_t f : band.functions) planes.push_back(3 + 3 * f);
    std::vector<float> errors = band_errors(statistics, charts, planes);
    for (size_t site = 0; site < lowered.size(); ++site) errors[site] *= lowered[site];
    state_unmet_bands(state_of(of_light, statistics.samples), errors);
    std::vector<float>& plane = map.band_error.add(band.name);
    for (size_t site = 0; site < errors.size(); ++site) plane[atlas.sites.texel[site]] = errors[site];
  }
}

// Replaces the measured planes and their errors by the filtered ones. Returns by what factor errors
// fell, by site.
std::vector<float> take_denoised(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics,
                                 const SurfaceGraph& surface, uint32_t levels, Baked& baked) {
  TexelErrors& errors = baked.errors;
  map.measured = map.planes;
  const auto drop = static_cast<ptrdiff_t>(map.planes.names.size() - 1);  // samples: they have a file
  map.measured.names.erase(map.measured.names.begin() + drop);
  map.measured.data.erase(map.measured.data.begin() + drop);
  const Denoised d =
      denoise_joined(statistics, map.bounds, surface.sites, surface.links, levels, 0, &baked.filters);
  std::vector<float> lowered(statistics.sites, 1.0f);
  for_each_index(statistics.sites, 0, [&](size_t site) {
    if (d.filled[site]) map.validity[atlas.sites.texel[site]] = Validity::kFilled;
    if (!statistics.known[site] && !d.filled[site]) return;
    if (d.raw_error[site] > 0 && std::isfinite(d.raw_error[site]))
      lowered[site] = d.standard_error[site] / d.raw_error[site];
    for (size_t p = 0; p < statistics.planes; ++p)
      map.planes.data[p][atlas.sites.texel[site]] = d.mean[site * statistics.planes + p];
    map.measured.plane("error")[atlas.sites.texel[site]] = d.raw_error[site];
    errors.mean[site] = d.luminance[site];
    errors.standard_error[site] = d.standard_error[site];
  });
  return lowered;
}

// Adds to the errors of texels that met no light what they may have missed.
void state_unmet_light(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics, Baked& baked) {
  TexelErrors& errors = baked.errors;
  errors.measured = mean_luminances(statistics);
  const std::vector<float> missed = unmet_errors(state_of(errors, statistics.samples), baked.unmet);
  std::vector<float>* const before_filters =
      map.measured.names.empty() ? nullptr : &map.measured.plane("error");
  const auto add = [](float& error, float missing) { error = std::hypot(error, missing); };
  for (size_t site = 0; site < missed.size(); ++site) {
    if (missed[site] == 0) continue;
    add(errors.standard_error[site], missed[site]);
    if (before_filters) add((*before_filters)[atlas.sites.texel[site]], missed[site]);
  }
}

// Resolves light: denoised if there is a surface, with its reported error.
void resolve_light(const BakeRun& run, const Accumulator& sums, const SurfaceGraph* surface,
                   std::span<const ChartLight> light, Baked& baked, Lightmap& map) {
  const Atlas& atlas = run.preflight.atlas;
  const BakeSettings& settings = run.request.settings;
  check_dark(map, atlas, run.report);
  if (std::string warning = warn_of_black_fronts(run.preflight.imported.scene, atlas, map); !warning.empty())
    run.report.warnings.push_back(std::move(warning));
  const BasisInfo& basis = basis_roster()[sums.layout().basis()];
  TexelStatistics statistics = sums.statistics(true, false);
  if (surface || !basis_bands(basis).empty()) statistics.shared = std::move(baked.shared);
  const std::vector<uint32_t> charts = charts_of_sites(atlas);
  std::vector<float> lowered;
  if (surface) {
    const uint32_t levels = std::max(denoise_levels(statistics), run.budget.denoise_levels());
    lowered = take_denoised(map, atlas, statistics, *surface, levels, baked);
  }
  state_unmet_light(map, atlas, statistics, baked);
  state_band_errors(map, atlas, statistics, charts, basis, lowered, baked.errors);
  state_deviations(atlas, light, baked.errors);
  state_errors(map, atlas, baked.errors);
  state_deviations(atlas, light, basis, map);
  run.report.statement =
      state_map(baked.errors, statistics, settings.error, normal_interval(settings.confidence));
  warn_of_few_samples(statistics, charts, run.report);
}

// The counts for a map without light that light would have provided.
void count_sampled(const Accumulator& sums, MapStatement& statement) {
  statement.texels = sums.sites();
  for (uint32_t site = 0; site < sums.sites(); ++site) statement.never_sampled += sums.samples(site) == 0;
}

// The reported error of every response, as a plane and as figures.
void resolve_responses(const BakeRun& run, const Accumulator& sums, std::span<const TexelErrors> errors,
                       Lightmap& map) {
  const Atlas& atlas = run.preflight.atlas;
  const BakeSettings& settings = run.request.settings;
  for (size_t k = 0; k < errors.size(); ++k) {
    const ResponseInfo& response = response_roster()[settings.quantities.responses[k]];
    std::vector<float>& plane = map.response_error.add(std::string(response.name));
    for (size_t site = 0; site < errors[k].standard_error.size(); ++site)
      if (std::isfinite(errors[k].standard_error[site]))
        plane[atlas.sites.texel[site]] = errors[k].standard_error[site];
    run.report.responses.push_back(state_response(response, errors[k], sums, settings.visibility_error,
                                                  normal_interval(settings.confidence)));
  }
}

}  // namespace

TexelErrors filtered_errors(const TexelStatistics& statistics, const SurfaceGraph& surface, uint32_t levels,
                            KeptFilters& filters) {
  Denoised d = denoise_joined_luminance(statistics, surface.sites, surface.links, levels, 0, &filters);
  for (size_t i = 0; i < statistics.sites; ++i)
    if (!statistics.known[i]) d.standard_error[i] = std::numeric_limits<float>::infinity();
  return {std::move(d.luminance), std::move(d.standard_error)};
}

Lightmap resolve_map(const BakeRun& run, const Accumulator& sums, const SurfaceGraph* surface,
                     std::span<const ChartLight> light, Baked& baked) {
  const char* const stage = surface ? "denoise" : "errors";
  const StageTimer timer(run.report.stages, stage);
  run.progress({.stage = stage});
  Lightmap map = sums.resolve(run.preflight.atlas);
  if (map.has_light)
    resolve_light(run, sums, surface, light, baked, map);
  else
    count_sampled(sums, run.report.statement);
  resolve_responses(run, sums, baked.responses, map);
  return map;
}

}  // namespace kiln
