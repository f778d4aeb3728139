// validity.png: the class of every lightmap texel. Shows the scene from the preview's camera and
// the atlas, both in class colours, and a legend.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/picture/picture.h"
#include "coordinator/picture/raster.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// Measured grey, pushed orange, filled yellow, dilated blue, inside magenta, empty black.
std::array<uint8_t, 3> class_color(Validity v);

// A pixel has the class of the texel that contains its point, darker at grazing angles except for
// magenta, which is always shown in full. The background is dark grey.
Picture validity_scene(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                       const Camera& camera, uint32_t width, uint32_t height);

// That view, the atlas and a legend.
Picture validity_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                         const Camera& camera, const View& view, uint32_t fine);

}  // namespace kiln
