// Lightmaps with known light, for tests of textures.
#pragma once

#include <functional>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln::test {

struct Baked {
  Scene scene;
  Atlas atlas;
  Lightmap map;
  BakeSettings settings;
};

// L0 of a colour channel, and L1/L0, at texel (x, y) of a page.
struct Light {
  double l0[3];
  double ratio[3];
};
using Field = std::function<Light(uint32_t x, uint32_t y)>;

// A box of 2 metres in layout pack at `texels_per_metre`, every texel of a chart measured with the field's
// planes, the rest empty. E is pi (L0 + 2 L1 . (0, 0, 1)).
Baked baked_box(float texels_per_metre, const Field& field, uint32_t mip_levels = 0);

// The map of a box with charts of any place, without a scene.
Field smooth_light();   // a wide ramp of colours, directions that turn slowly
Field edge_of_light();  // 1 beside 100

}  // namespace kiln::test
