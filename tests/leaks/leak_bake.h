// A bake without processes up to the finished map, and lookups into it as an engine makes them.
#pragma once

#include <functional>

#include "common/atlas/atlas_lookup.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln::test {

struct LeakBake {
  Scene scene;
  Atlas atlas;
  Lightmap map;  // filled and dilated

  // Luminance of E by a plain bilinear lookup: every texel counts, whatever its class.
  double bilinear(const AtlasPlace& place) const;
};

LeakBake bake_map(Scene scene, AtlasSettings atlas, uint32_t samples, uint64_t seed = 0);

// Calls visit(position, normal, E) for a grid of `steps` x `steps` points on every triangle.
void for_each_point(const LeakBake& bake, uint32_t steps,
                    const std::function<void(const Vec3&, const Vec3&, double)>& visit);

}  // namespace kiln::test
