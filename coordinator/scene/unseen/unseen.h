// Which charts nobody can see: no camera looks into the room of air before them, no light shines there, and
// it has no opening to the sky.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/scene/density/wishes.h"
#include "coordinator/scene/unseen/light_seeds.h"

namespace kiln {

// Two sides of charts are in one region of air where a ray goes from one to the other's front. A region is
// seen where a camera, a lamp or a surface that shines is in it, or where a ray leaves it for the sky;
// without a sky the outside is a region as any other. A chart is unseen if none of its sides is in a seen
// region: what lies inside walls meets backs alone, which show nothing and let no light through. Whatever
// rays decide, a bake would find: no path from an unseen chart meets light.
//
// Of every chart points spread over it send rays in fixed directions. What a ray meets is linked to the point
// of that chart beside which it lies, if the way there is free: a floor that goes on beneath a wall does not
// join what is on its sides. What is not found seen then does so again with many more points, whose rays go
// on from what they meet, and looks for each seed. Results are the same for any number of threads.
class UnseenCharts {
 public:
  // `scene` outlives this; `threads` 0: all.
  UnseenCharts(const Scene& scene, const std::vector<Viewpoint>& cameras, unsigned threads = 0);

  // False: there is neither camera nor light, so that nothing can be said and every chart counts as seen.
  bool decides() const { return decides_; }

  // By placement: 1, nobody sees it. Charts that have the least texels anyway are not asked. For
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
