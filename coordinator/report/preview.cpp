#include "coordinator/report/preview.h"

#include <algorithm>

#include "common/base/parallel.h"
#include "coordinator/imageio/imageio.h"
#include "coordinator/look/surface_look.h"
#include "coordinator/look/tone.h"
#include "coordinator/report/raster.h"

namespace kiln {
namespace {

uint8_t display(float exposed, bool curve = true) {
  return static_cast<uint8_t>(
      std::lround(255.0f * linear_to_srgb(curve ? filmic(exposed) : std::max(0.0f, exposed))));
}

struct Shot {
  std::vector<Vec3> radiance;
  std::vector<uint8_t> kind;  // 0 sky, 1 lit surface, 2 surface without a value
};

Shot shade(const SurfaceLook& look, const View& view, const Camera& camera) {
  Shot shot{std::vector<Vec3>(view.fragments.size()), std::vector<uint8_t>(view.fragments.size(), 0)};
  const float focal = 0.5f * static_cast<float>(view.height) / std::tan(0.5f * camera.vertical_fov);
  parallel_for(view.height, [&](size_t y) {
    for (size_t x = 0; x < view.width; ++x) {
      const size_t i = y * view.width + x;
      const Fragment& f = view.fragments[i];
      if (f.inverse_depth == 0) {
        const Vec3 local(static_cast<float>(x) + 0.5f - 0.5f * static_cast<float>(view.width),
                         0.5f * static_cast<float>(view.height) - static_cast<float>(y) - 0.5f, -focal);
        shot.radiance[i] = look.sky(normalize_or(transform_vector(camera.to_world, local), Vec3(0, 0, -1)));
        continue;
      }
      Vec3 e;
      shot.kind[i] = look.irradiance(f, e) ? 1 : 2;
      if (shot.kind[i] == 1) shot.radiance[i] = Vec3(look.base_color(f)) * e * kInvPi + look.emission(f);
    }
  });
  return shot;
}

}  // namespace

Picture render_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, uint32_t width, uint32_t height, const ViewStyle& style) {
  const SurfaceLook look(imported.scene, atlas, map, style.textures);
  const uint32_t fine = style.smooth ? kSupersample : 1;
  const View view = rasterise(imported.scene, camera, width * fine, height * fine,
                              [&](const Fragment& f) { return look.visible(f); });
  const Shot shot = shade(look, view, camera);
  std::vector<float> lit;
  for (size_t i = 0; i < shot.kind.size(); ++i)
    if (shot.kind[i] == 1) lit.push_back(luminance(shot.radiance[i]));
  const float exposure = style.exposure > 0 ? style.exposure : exposure_of(std::move(lit));
  return supersampled(width, height, fine, [&](size_t i) {
    if (shot.kind[i] == 2) return Vec3(255, 0, 255);
    Vec3 color;
    for (int c = 0; c < 3; ++c) color[c] = display(shot.radiance[i][c] * exposure, style.filmic);
    return color;
  });
}

Picture atlas_picture(const Lightmap& map, uint32_t size) {
  std::vector<float> lit;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kMeasured)
      lit.push_back(luminance(Vec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t])));
  const float exposure = exposure_of(std::move(lit));
  return page_sheet(map, size, [&](size_t t) -> std::array<uint8_t, 3> {
    if (map.validity[t] == Validity::kEmpty) return {24, 24, 24};
    if (map.validity[t] == Validity::kInside) return {255, 0, 255};
    std::array<uint8_t, 3> rgb;
    for (size_t c = 0; c < 3; ++c) rgb[c] = display(map.planes.data[c][t] * exposure);
    return rgb;
  });
}

Camera preview_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map) {
  return imported.camera ? *imported.camera : choose_camera(imported, atlas, map);
}

Status write_preview(const std::filesystem::path& path, const ImportResult& imported, const Atlas& atlas,
                     const Lightmap& map, const Camera& camera) {
  constexpr uint32_t kHeight = 720, kWidth = 1280, kGap = 8;
  const Picture view = render_view(imported, atlas, map, camera, kWidth, kHeight);
  const Picture sheet = atlas_picture(map, kHeight);
  Picture both(kWidth + kGap + sheet.width, kHeight, 16);
  both.paste(view, 0, 0);
  both.paste(sheet, kWidth + kGap, 0);
  return write_png(path, both.width, both.height, both.rgb);
}

}  // namespace kiln
