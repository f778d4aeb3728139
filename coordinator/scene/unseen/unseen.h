// Finds charts that nobody can see: the region of air in front of them has no camera, no light and no opening
// to the sky.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/scene/density/wishes.h"
#include "coordinator/scene/unseen/light_seeds.h"

namespace kiln {

// Two chart sides are in the same region of air if a ray from one reaches the other's front. A region is seen
// if it contains a camera, a lamp or an emissive surface, or if a ray leaves it for the sky; without a sky
// the outside is a region like any other. A chart is unseen if none of its sides is in a seen region:
// surfaces inside walls see only backs, which are black and block light. A bake would agree: no path from an
// unseen chart finds light.
//
// Points spread over every chart send rays in fixed directions. A hit is linked to the nearest point of the
// chart it lies on, if the path between them is free: a floor that continues beneath a wall does not join the
// two sides. Charts not yet seen try again with many more points, whose rays continue from their hits, and
// test each seed. Independent of the number of threads.
class UnseenCharts {
 public:
  // `scene` outlives this; `threads` 0: all.
  UnseenCharts(const Scene& scene, const std::vector<Viewpoint>& cameras, unsigned threads = 0);

  // False if there is neither camera nor light: then every chart counts as seen.
  bool decides() const { return decides_; }

  // By placement: 1 if unseen. Charts already at the minimum size are not tested. For
  // AtlasSettings::collapse.
  std::vector<uint8_t> find(const ChartsToSize& charts) const;

 private:
  const Scene& scene_;
  const unsigned threads_;
  Solid solid_;
  SceneRays rays_;
  Seeds seeds_;
  bool decides_;
};

}  // namespace kiln
