#include "coordinator/report/report_pictures.h"

#include <algorithm>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/parallel.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/density_view.h"
#include "coordinator/report/preview.h"
#include "coordinator/report/response_view.h"
#include "coordinator/report/validity_view.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

// A PNG is compressed by one thread.
Expected<std::vector<Bytes>> pngs(const std::vector<Picture>& pictures) {
  std::vector<Expected<Bytes>> made(pictures.size());
  parallel_for(pictures.size(), [&](size_t i) {
    made[i] = encode_png(pictures[i].width, pictures[i].height, pictures[i].rgb);
  });
  std::vector<Bytes> files(made.size());
  for (size_t i = 0; i < made.size(); ++i) {
    KILN_TRY(files[i], std::move(made[i]));
  }
  return files;
}

}  // namespace

Expected<ReportPictures> make_pictures(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                       const Camera& camera, PictureSize size, const Quantities& quantities) {
  const SurfaceLook look(imported.scene, atlas, map);
  const View view = rasterise(imported.scene, camera, size.width * kSupersample, size.height * kSupersample,
                              [&](const Fragment& f) { return look.visible(f); });
  const auto picture_of = [&](uint32_t response) {
    return response_picture(imported, atlas, map, response_roster()[response], view, kSupersample);
  };
  std::vector<uint32_t> responses(quantities.responses);
  std::vector<Picture> pictures{map.has_light
                                    ? preview_picture(imported, atlas, map, camera, view, kSupersample)
                                    : picture_of(responses.front())};
  if (!map.has_light) responses.erase(responses.begin());  // shown as the preview
  pictures.push_back(validity_picture(imported, atlas, map, camera, view, kSupersample));
  pictures.push_back(density_picture(imported, atlas, camera, view, kSupersample));
  for (const uint32_t response : responses) pictures.push_back(picture_of(response));
  KILN_TRY(std::vector<Bytes> files, pngs(pictures));
  ReportPictures out{std::move(files[0]), std::move(files[1]), std::move(files[2]), {}};
  for (size_t r = 0; r < responses.size(); ++r)
    out.responses.emplace_back(response_roster()[responses[r]].about, std::move(files[3 + r]));
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
