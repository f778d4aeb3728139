// Bakes of whole scenes in this process, with and without an irradiance cache.
#pragma once

#include "worker/bake/baker.h"

namespace kiln::test {

class CachedBake {
 public:
  // Layout pack, charts as the meshes have them. The sampler becomes kRandom: samples are independent.
  CachedBake(const Scene& scene, float texels_per_metre, TransportSettings settings);

  // Sums of all sites in order, over samples [first, first + count) of a replicate.
  Expected<UnitResult> run(uint32_t first, uint32_t count, const IrradianceCache* cache = nullptr,
                           uint32_t replicate = 0, uint32_t take = 0) const;

  const Scene& scene() const { return scene_; }
  const Atlas& atlas() const { return atlas_; }
  size_t sites() const { return atlas_.sites.size(); }
  const Baker& baker() const { return *baker_; }
  uint32_t instance_of(uint32_t site) const;

 private:
  Scene scene_;
  Atlas atlas_;
  std::unique_ptr<Baker> baker_;
};

// The same irradiance everywhere.
IrradianceCache uniform_cache(size_t sites, const Vec3& irradiance);
// What a bake found; unknown where more than half of the primary rays met back faces.
IrradianceCache cache_of(const UnitResult& result, uint32_t samples);

// Luminance of E, mean over sites, with the error of its independent samples.
struct MeanE {
  double value = 0, error = 0;
};
MeanE mean_e(const UnitResult& result, uint32_t samples);

}  // namespace kiln::test
