#include "coordinator/report/report_pictures.h"

#include <algorithm>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/density_view.h"
#include "coordinator/report/preview.h"
#include "coordinator/report/response_view.h"
#include "coordinator/report/validity_view.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

Expected<Bytes> png(const Picture& picture) {
  return encode_png(picture.width, picture.height, picture.rgb);
}

}  // namespace

Expected<ReportPictures> make_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera, PictureSize size, const Quantities& quantities) {
  const SurfaceLook look(imported.scene, atlas, map);
  const View view = rasterise(imported.scene, camera, size.width * kSupersample, size.height * kSupersample,
                              [&](const Fragment& f) { return look.visible(f); });
  ReportPictures out;
  const auto picture_of = [&](uint32_t response) {
    return response_picture(imported, atlas, map, response_roster()[response], view, kSupersample);
  };
  KILN_TRY(out.preview, png(map.has_light ? preview_picture(imported, atlas, map, camera, view, kSupersample)
                                          : picture_of(quantities.responses.front())));
  for (const uint32_t response : quantities.responses) {
    if (!map.has_light && response == quantities.responses.front()) continue;  // shown above
    KILN_TRY(Bytes picture, png(picture_of(response)));
    out.responses.emplace_back(response_roster()[response].about, std::move(picture));
  }
  KILN_TRY(out.validity, png(validity_picture(imported, atlas, map, camera, view, kSupersample)));
  KILN_TRY(out.density, png(density_picture(imported, atlas, camera, view, kSupersample)));
  return out;
}

Expected<ReportPictures> write_pictures(const std::filesystem::path& folder, const ImportResult& imported,
                                        const Atlas& atlas, const Lightmap& map,
                                        const BakeSettings& settings) {
  if (!settings.preview) return ReportPictures{};
  const Quantities& quantities = settings.quantities;
  KILN_TRY(const Camera camera,
           map.has_light
               ? preview_camera(imported, atlas, map, settings.camera)
               : preview_camera(imported, atlas, lit_by(map, response_roster()[quantities.responses.front()]),
                                settings.camera));
  KILN_TRY(ReportPictures pictures,
           make_pictures(imported, atlas, map, camera, {settings.preview_width, settings.preview_height},
                         quantities));
  KILN_TRY_STATUS(write_file_atomic(folder / "preview.png", pictures.preview));
  KILN_TRY_STATUS(write_file_atomic(folder / "validity.png", pictures.validity));
  return pictures;
}

Expected<PictureCost> measure_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera) {
  constexpr PictureSize kSmall{64, 36}, kLarge{256, 144};
  const auto seconds = [&](PictureSize size) -> Expected<double> {
    const Stopwatch watch;
    KILN_TRY_STATUS(make_pictures(imported, atlas, map, camera, size));
    return watch.seconds();
  };
  KILN_TRY(const double small, seconds(kSmall));
  KILN_TRY(const double large, seconds(kLarge));
  PictureCost cost;
  constexpr double kPixels = kLarge.width * kLarge.height - kSmall.width * kSmall.height;
  cost.per_pixel = std::max(0.0, large - small) / kPixels;
  cost.fixed = std::max(0.0, small - cost.per_pixel * kSmall.width * kSmall.height);
  return cost;
}

}  // namespace kiln
