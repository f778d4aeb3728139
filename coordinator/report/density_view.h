// Where the texels are: the scene coloured by texels per metre, with the texels themselves as squares.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/picture/picture.h"
#include "coordinator/picture/raster.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// Every texel with a site has E = 1: what previews show before a bake.
Lightmap unbaked_lightmap(const Atlas& atlas);

// Seen by `camera`, with a scale below; nothing is traced. Colours are logarithmic, from the power of two
// times the scene's density below most of what is seen to the one above. Squares fade out where a texel is
// smaller than a few pixels; faces without texels are grey.
Picture density_view(const ImportResult& imported, const Atlas& atlas, const Camera& camera, uint32_t width,
                     uint32_t height);
// Of what has been rasterised for that camera; fine^2 of its pixels make one of the picture.
Picture density_picture(const ImportResult& imported, const Atlas& atlas, const Camera& camera,
                        const View& view, uint32_t fine);

}  // namespace kiln
