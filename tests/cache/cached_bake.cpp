#include "tests/cache/cached_bake.h"

#include <cmath>

#include "common/base/parallel.h"
#include "common/responses/basis.h"

namespace kiln::test {

CachedBake::CachedBake(const Scene& scene, float texels_per_metre, TransportSettings settings)
    : scene_(scene) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = texels_per_metre;
  a.cut_contacts = false;
  auto atlas = build_atlas(scene_, a);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  atlas_ = std::move(*atlas);
  settings.sampler = Sampler::kRandom;
  auto baker = Baker::create(scene_, atlas_, settings, 2);
  if (!baker) throw std::runtime_error(baker.error().message);
  baker_ = std::move(*baker);
}

Expected<UnitResult> CachedBake::run(uint32_t first, uint32_t count, const IrradianceCache* cache,
                                     uint32_t replicate, uint32_t take) const {
  constexpr size_t kRun = 64;
  std::vector<WorkUnit> units((sites() + kRun - 1) / kRun);
  for (size_t u = 0; u < units.size(); ++u) {
    units[u].first_sample = first;
    units[u].sample_count = count;
    units[u].replicate = replicate;
    units[u].take = take;
    for (size_t s = u * kRun; s < std::min(sites(), (u + 1) * kRun); ++s)
      units[u].sites.push_back(static_cast<uint32_t>(s));
  }
  std::vector<Expected<UnitResult>> results(units.size(), UnitResult{});
  parallel_for(units.size(), [&](size_t u) { results[u] = baker_->bake(units[u], cache); });
  UnitResult all;
  for (const Expected<UnitResult>& r : results) {
    if (!r) return r;
    EXPECT_EQ(r->nonfinite, 0u);
    all.site_count += r->site_count;
    all.plane_count = r->plane_count;
    all.rays += r->rays;
    all.moments.insert(all.moments.end(), r->moments.begin(), r->moments.end());
  }
  return all;
}

uint32_t CachedBake::instance_of(uint32_t site) const {
  return atlas_.sites.words[atlas_.sites.first_word[site] + 4];
}

IrradianceCache uniform_cache(size_t sites, const Vec3& irradiance) {
  return {std::vector<Vec3>(sites, irradiance)};
}

IrradianceCache cache_of(const UnitResult& result, uint32_t samples) {
  IrradianceCache cache = uniform_cache(result.site_count, Vec3(-1.0f));
  for (size_t s = 0; s < result.site_count; ++s) {
    const double* sums = &result.moments[s * result.plane_count];
    if (sums[kMomentInside] > 0.5 * samples) continue;
    cache.irradiance[s] =
        Vec3(DVec3(sums[kMomentER], sums[kMomentEG], sums[kMomentEB]) / static_cast<double>(samples));
  }
  return cache;
}

MeanE mean_e(const UnitResult& result, uint32_t samples) {
  double sum = 0, variance = 0;
  for (size_t s = 0; s < result.site_count; ++s) {
    const double* sums = &result.moments[s * result.plane_count];
    const double mean = sums[kMomentLum] / samples;
    sum += mean;
    variance += std::max(0.0, sums[kMomentLum2] / samples - mean * mean) / (samples - 1);
  }
  return {sum / result.site_count, std::sqrt(variance) / result.site_count};
}

}  // namespace kiln::test
