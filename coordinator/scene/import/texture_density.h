// Textures cut down to what a diffuse bounce can see of them.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Reduces every texture of a material (linear box filter, the mean is kept) while it stays finer than
// kTexelsPerLightmapTexel along each edge of the lightmap's texels wherever it is used. Textures that cut
// shapes by their alpha, and those to be read unfiltered, stay as they are. `factor`: the densest object's.
void reduce_to_density(Scene& scene, const BakeSettings& settings, double factor, ImportNotes& notes);

}  // namespace kiln
