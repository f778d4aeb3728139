// Bakes without processes: two replicates of every site, as the denoiser reads them, and a reference.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_window.h"

namespace kiln::test {

struct ReplicateBake {
  Scene scene;
  Atlas atlas;
  SiteGeometry sites;
  SurfaceLinks links;
  TexelStatistics statistics;
};

// `samples` of each replicate; seeds of different bakes are independent. Planes of basis sh_l1.
ReplicateBake bake_replicates(const Scene& scene, float texels_per_metre, uint32_t samples,
                              uint64_t seed = 0);

// Statistics of another number of samples or seed of the same bake.
TexelStatistics statistics_of(const ReplicateBake& bake, uint32_t samples, uint64_t seed);

}  // namespace kiln::test
