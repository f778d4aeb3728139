// preview.png: the lit scene as its camera sees it, rendered through the lightmap, beside the atlas.
#pragma once

#include <filesystem>

#include "common/atlas/atlas.h"
#include "coordinator/import/import.h"
#include "coordinator/lightmap/lightmap.h"
#include "coordinator/report/picture.h"

namespace kiln {

// How a view is shown.
struct ViewStyle {
  float exposure = 0;    // factor of radiance; 0: from the picture's own median
  bool filmic = true;    // the curve; off: exposed radiance is clipped
  bool smooth = true;    // the mean of kSupersample^2 pixels each
  bool textures = true;  // off: colours are the materials' factors alone
};

// The scene seen by `camera`: base colour / pi x E, emission, sky, in sRGB. Surfaces without a lightmap value
// are magenta.
Picture render_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, uint32_t width, uint32_t height, const ViewStyle& style = {});

// One that sees many lit surfaces from their front at varied distance.
Camera choose_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map);

// The atlas, tone-mapped, pages side by side, scaled to at most `size` a side.
Picture atlas_picture(const Lightmap& map, uint32_t size);

// The file's camera, or one chosen.
Camera preview_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map);

Status write_preview(const std::filesystem::path& path, const ImportResult& imported, const Atlas& atlas,
                     const Lightmap& map, const Camera& camera);

}  // namespace kiln
