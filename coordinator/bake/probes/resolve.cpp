#include "coordinator/bake/probes/resolve.h"

#include <cmath>
#include <limits>

#include "common/base/parallel.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {
namespace {

Vec3 mean_of(const Accumulator& sums, uint32_t site, size_t plane, uint32_t replicate) {
  const double n = sums.samples(site, replicate);
  return Vec3(DVec3(sums.sum(site, plane, replicate), sums.sum(site, plane + 1, replicate),
                    sums.sum(site, plane + 2, replicate)) /
              n);
}

// Of coefficient k. The variance of a sample is twice that of the mean of a pair.
TexelStatistics statistics_of(const Accumulator& sums, size_t k) {
  const size_t count = sums.sites(), function = kFromMoments[k].function;
  const size_t plane = kMomentBasis + 3 * function, squares = sums.layout().pair_squares() + function;
  const double scale = kFromMoments[k].scale;
  TexelStatistics out;
  out.sites = count;
  out.variance.assign(count, 0.0f);
  out.samples = sums.replicate_samples();
  out.known.assign(count, 0);
  for (uint32_t r = 0; r < kReplicates; ++r) out.luminance[r].assign(count, 0.0f);
  for_each_index(count, 0, [&](size_t index) {
    const auto site = static_cast<uint32_t>(index);
    if (out.samples[site] < 2) return;
    out.known[site] = 1;
    double rest = 0, pairs = 0;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      const double mean = luminance(DVec3(mean_of(sums, site, plane, r)));
      const double of_replicate = 0.5 * sums.samples(site, r);
      rest += std::max(0.0, sums.sum(site, squares, r) - of_replicate * mean * mean);
      pairs += of_replicate;
      out.luminance[r][site] = static_cast<float>(scale * mean);
    }
    out.variance[site] =
        static_cast<float>(scale * scale * 2 * rest / std::max(1.0, pairs - double{kReplicates}));
  });
  return out;
}

}  // namespace

ProbeErrors probe_errors(const Accumulator& sums, std::span<const uint32_t> volumes) {
  ProbeErrors out;
  const size_t count = sums.sites();
  out.coefficient.resize(count);
  out.irradiance.assign(count, 0.0f);
  out.mean.assign(count, 0.0f);
  out.samples = sums.replicate_samples();
  for (size_t k = 0; k < kHarmonics; ++k) {
    const TexelErrors errors = estimate_errors(statistics_of(sums, k), volumes);
    // E's coefficient is this factor times that of radiance; the mean of its square over all normals is the
    // sum of squares over 4 pi.
    const float factor = kCosineFactor[kHarmonicDegree[k]];
    for (size_t i = 0; i < count; ++i) {
      const float e = errors.standard_error[i];
      out.coefficient[i][k] = e;
      out.irradiance[i] += factor * factor * e * e * (0.25f * kInvPi);
      if (k == 0) out.mean[i] = std::max(0.0f, errors.mean[i] * factor * 0.2820947918f);
    }
  }
  for (float& e : out.irradiance) e = std::sqrt(e);
  return out;
}

void resolve_probes(const Accumulator& sums, const ProbeErrors& errors, std::span<const uint32_t> probes,
                    ProbeField& field) {
  const MomentLayout& layout = sums.layout();
  for_each_index(sums.sites(), 0, [&](size_t index) {
    const auto site = static_cast<uint32_t>(index);
    const uint32_t probe = probes[site];
    const double n = sums.samples(site);
    if (!(n > 0)) return;
    const auto mean = [&](size_t plane) { return (sums.sum(site, plane, 0) + sums.sum(site, plane, 1)) / n; };
    const auto rgb = [&](size_t plane) { return Vec3(DVec3(mean(plane), mean(plane + 1), mean(plane + 2))); };
    for (size_t k = 0; k < kHarmonics; ++k)
      field.light[probe][k] = kFromMoments[k].scale * rgb(kMomentBasis + 3 * kFromMoments[k].function);
    field.error[probe] = errors.coefficient[site];
    field.irradiance_error[probe] = errors.irradiance[site];
    field.samples[probe] = sums.samples(site);
    field.validity[probe] = static_cast<float>(1 - mean(kMomentInside));
    if (!layout.quantities().probe_visibility) return;
    for (uint32_t t = 0; t < kIrradianceTexels; ++t)
      field.irradiance[size_t{probe} * kIrradianceTexels + t] = rgb(layout.octahedral() + 3 * t);
    for (uint32_t t = 0; t < kDistanceTexels; ++t) {
      const size_t plane = layout.distances() + 3 * t;
      const double weight = mean(plane);
      if (weight > 0)
        field.distance[size_t{probe} * kDistanceTexels + t] =
            Vec2(static_cast<float>(mean(plane + 1) / weight), static_cast<float>(mean(plane + 2) / weight));
    }
  });
}

}  // namespace kiln
