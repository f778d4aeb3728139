// preview.png: the lit scene as its camera sees it, rendered through the lightmap, beside the atlas.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/picture/picture.h"
#include "coordinator/picture/raster.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// Display settings of a view.
struct ViewStyle {
  float exposure = 0;    // exposure factor; 0: from the picture's median
  bool filmic = true;    // apply the filmic curve; off: clip exposed radiance
  bool smooth = true;    // average kSupersample^2 pixels each
  bool textures = true;  // off: colours are the materials' factors alone
};

// The scene seen by `camera`: base colour / pi x E, emission, sky, in sRGB. Surfaces without a lightmap value
// are magenta. A blended surface that is more transparent than opaque is laid over what is behind it as
// engines do it: displayed values, mixed by alpha; of several, the nearest one.
Picture render_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, uint32_t width, uint32_t height, const ViewStyle& style = {});
// From fragments rasterised for that camera, with the visibility rules of SurfaceLook; `fine`^2 of
// their pixels make one pixel of the picture.
Picture shaded_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, const View& view, uint32_t fine, const ViewStyle& style = {});

// The atlas, tone-mapped, pages side by side, scaled to at most `size` pixels a side.
Picture atlas_picture(const Lightmap& map, uint32_t size);

// The scene and the atlas side by side.
Picture preview_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                        const Camera& camera, const View& view, uint32_t fine);

}  // namespace kiln
