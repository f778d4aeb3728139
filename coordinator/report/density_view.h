// Texel density: the scene coloured by texels per metre, with texels drawn as squares.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/picture/picture.h"
#include "coordinator/picture/raster.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// E = 1 in every texel with a site: shown by previews before a bake.
Lightmap unbaked_lightmap(const Atlas& atlas);

// Seen from `camera`, with a scale below; no rays are traced. Colours are logarithmic; the scale
// runs between powers of two times the scene's density that enclose most of what is seen. Squares
// fade out where a texel is smaller than a few pixels; faces without texels are grey.
Picture density_view(const ImportResult& imported, const Atlas& atlas, const Camera& camera, uint32_t width,
                     uint32_t height);
// From fragments rasterised for that camera; fine^2 of their pixels make one pixel of the picture.
Picture density_picture(const ImportResult& imported, const Atlas& atlas, const Camera& camera,
                        const View& view, uint32_t fine);

}  // namespace kiln
