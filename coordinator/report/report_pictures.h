// The report's pictures of the scene, all from one rasterisation.
#pragma once

#include <filesystem>

#include "common/base/bytes.h"
#include "coordinator/report/camera.h"

namespace kiln {

struct PictureSize {
  uint32_t width = 1280, height = 720;  // size of the scene pictures
};

// PNG files; empty if absent
struct ReportPictures {
  Bytes preview, validity, density;
  std::vector<std::pair<std::string, Bytes>> responses{};  // name and picture of each response
};

// `quantities`: the map's.
Expected<ReportPictures> make_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera, PictureSize size,
                                       const Quantities& quantities = {});

// Finds the camera, renders the pictures and writes preview.png and validity.png, unless
// settings.preview is off.
Expected<ReportPictures> write_pictures(const std::filesystem::path& folder, const ImportResult& imported,
                                        const Atlas& atlas, const Lightmap& map,
                                        const BakeSettings& settings);

// Cost of pictures on this machine, measured on two small ones; for time budgets.
struct PictureCost {
  double fixed = 0, per_pixel = 0;  // seconds
  double seconds(PictureSize size) const { return fixed + per_pixel * size.width * size.height; }
};
Expected<PictureCost> measure_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera);

}  // namespace kiln
