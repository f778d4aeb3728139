// Reduces textures to the resolution that a diffuse bounce can resolve.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Reduces every texture of a material (linear box filter, the mean is kept) while it stays finer than
// kTexelsPerLightmapTexel along each edge of the lightmap's texels wherever it is used. Alpha-tested
// textures, and unfiltered ones, are kept. `factor`: the densest object's.
void reduce_to_density(Scene& scene, const BakeSettings& settings, double factor, ImportNotes& notes);

}  // namespace kiln
