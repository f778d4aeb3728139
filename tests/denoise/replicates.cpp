#include "tests/denoise/replicates.h"

#include <stdexcept>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/responses/basis.h"
#include "worker/bake/baker.h"
#include "worker/surface/surfaces.h"

namespace kiln::test {
namespace {

void add_replicate(const ReplicateBake& b, uint32_t r, uint32_t samples, uint64_t seed,
                   TexelStatistics& out) {
  TransportSettings settings;
  settings.seed = 2 * seed + r;
  auto baker = Baker::create(b.scene, b.atlas, settings, 2);
  if (!baker) throw std::runtime_error(baker.error().message);
  constexpr size_t kRun = 64;
  const size_t sites = b.sites.size();
  const size_t heads = kMomentBasis;
  parallel_for((sites + kRun - 1) / kRun, [&](size_t run) {
    WorkUnit unit;
    unit.id = run;
    unit.sample_count = samples;
    for (size_t s = run * kRun; s < std::min(sites, (run + 1) * kRun); ++s)
      unit.sites.push_back(static_cast<uint32_t>(s));
    const UnitResult result = *(*baker)->bake(unit);
    for (size_t i = 0; i < unit.sites.size(); ++i) {
      const double* sum = &result.moments[i * result.plane_count];
      const size_t s = unit.sites[i];
      float* mean = &out.mean[r][s * out.planes];
      for (size_t c = 0; c < 3; ++c) mean[c] = static_cast<float>(sum[kMomentER + c] / samples);
      for (size_t p = 3; p < out.planes; ++p) mean[p] = static_cast<float>(sum[heads + p - 3] / samples);
      const double m = sum[kMomentLum] / samples;
      out.luminance[r][s] = static_cast<float>(m);
      out.variance[s] +=
          static_cast<float>(std::max(0.0, (sum[kMomentLum2] - samples * m * m) / (samples - 1)) / 2);
      if (sum[kMomentInside] > 0.5 * samples) out.known[s] = 0;
    }
  });
}

}  // namespace

TexelStatistics statistics_of(const ReplicateBake& b, uint32_t samples, uint64_t seed) {
  TexelStatistics out;
  out.sites = b.sites.size();
  out.planes = 15;
  out.variance.assign(out.sites, 0);
  out.samples.assign(out.sites, samples);
  out.known.assign(out.sites, 1);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    out.mean[r].resize(out.sites * out.planes);
    out.luminance[r].resize(out.sites);
    add_replicate(b, r, samples, seed, out);
  }
  return out;
}

ReplicateBake bake_replicates(const Scene& scene, float texels_per_metre, uint32_t samples, uint64_t seed) {
  ReplicateBake b;
  b.scene = scene;
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = texels_per_metre;
  auto atlas = build_atlas(b.scene, settings);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  b.atlas = std::move(*atlas);
  b.sites = site_geometry(b.scene, b.atlas, 0);
  b.links = surface_links(b.scene, b.atlas, b.sites, 0);
  b.statistics = statistics_of(b, samples, seed);
  return b;
}

}  // namespace kiln::test
