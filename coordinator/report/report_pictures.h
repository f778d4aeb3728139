// The pictures of the scene that a report holds, all of one rasterisation.
#pragma once

#include <filesystem>

#include "common/base/bytes.h"
#include "coordinator/report/camera.h"

namespace kiln {

struct PictureSize {
  uint32_t width = 1280, height = 720;  // of the scene in them
};

// PNG files; empty: there are none.
struct ReportPictures {
  Bytes preview, validity, density;
  std::vector<std::pair<std::string, Bytes>> responses{};  // what each is of
};

// `quantities`: those of the map.
Expected<ReportPictures> make_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera, PictureSize size,
                                       const Quantities& quantities = {});

// Finds the camera, makes the pictures and writes preview.png and validity.png, unless settings.preview is
// off.
Expected<ReportPictures> write_pictures(const std::filesystem::path& folder, const ImportResult& imported,
                                        const Atlas& atlas, const Lightmap& map,
                                        const BakeSettings& settings);

// What pictures cost on this machine, from two small ones that are made: for whoever has an allowance of
// time.
struct PictureCost {
  double fixed = 0, per_pixel = 0;  // seconds
  double seconds(PictureSize size) const { return fixed + per_pixel * size.width * size.height; }
};
Expected<PictureCost> measure_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera);

}  // namespace kiln
