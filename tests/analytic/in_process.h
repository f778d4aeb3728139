// A bake without processes: atlas, baker, accumulator. For tests of transport.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "common/atlas/atlas.h"
#include "coordinator/bake/merge/accumulator.h"
#include "worker/bake/baker.h"

namespace kiln::test {

struct BakedTexel {
  Vec3 position, ns;  // of the mean of its sites
  Vec3 e;             // irradiance
  double luminance, standard_error;
  Vec3 l0, l1[3];  // of basis sh_l1: RGB; l1[k] is the k-th axis
  bool inside, pushed;
  uint32_t instance, site;
  double coverage;  // share of the texel that is surface
};

struct Bake {
  Scene scene;
  Atlas atlas;
  std::vector<BakedTexel> texels;  // those baked, by site
  Lightmap map;                    // as merge resolves it
  std::shared_ptr<const Accumulator> sums;
};

// Bakes with a fixed number of samples, two threads, layout pack; of both replicates, half of them each,
// where settings ask for responses. With `only`, texels of other instances are left out (walls and panes that
// are there to cast shadows).
Bake bake(Scene scene, float texels_per_metre, uint32_t samples, TransportSettings settings = {},
          std::optional<uint32_t> only = std::nullopt);

// Mean over texels of instance 0 of E and of truth(texel), and the share of them whose E lies within three
// stated standard errors of the truth (all channels equal to luminance in these scenes).
struct Comparison {
  double mean = 0, true_mean = 0, share_within_3 = 0;
  size_t texels = 0;
};
// `truth` gives E averaged over a texel; see texel_average().
Comparison compare(const Bake& bake, const std::function<double(uint32_t site)>& truth,
                   uint32_t instance = 0);

// Average over the valid sites of a texel of f(point, normal).
double texel_average(const Bake& bake, uint32_t site,
                     const std::function<double(const Vec3&, const Vec3&)>& f);

}  // namespace kiln::test
