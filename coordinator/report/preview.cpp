#include "coordinator/report/preview.h"

#include <algorithm>

#include "common/base/parallel.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/output/look/tone.h"
#include "coordinator/picture/raster.h"

namespace kiln {
namespace {

uint8_t display(float exposed, bool curve = true) {
  return linear_to_srgb8(curve ? filmic(exposed) : exposed);
}

struct Shot {
  std::vector<Vec3> radiance;
  std::vector<uint8_t> kind;  // 0 sky, 1 lit surface, 2 surface without a value, 3 object without texels
};

// Objects without texels are shown in the median light of those with texels.
void light_others(const SurfaceLook& look, const View& view, Shot& shot) {
  std::vector<float> light;
  for (size_t i = 0; i < shot.kind.size(); ++i)
    if (Vec3 e; shot.kind[i] == 1 && look.irradiance(view.fragments[i], e)) light.push_back(luminance(e));
  if (light.empty()) return;
  const auto middle = light.begin() + static_cast<ptrdiff_t>(light.size() / 2);
  std::nth_element(light.begin(), middle, light.end());
  for (size_t i = 0; i < shot.kind.size(); ++i)
    if (shot.kind[i] == 3)
      shot.radiance[i] =
          Vec3(look.base_color(view.fragments[i])) * (*middle * kInvPi) + look.emission(view.fragments[i]);
}

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
      shot.kind[i] = look.irradiance(f, e) ? 1 : look.receives(f) ? 2 : 3;
      if (shot.kind[i] == 1) shot.radiance[i] = Vec3(look.base_color(f)) * e * kInvPi + look.emission(f);
    }
  });
  if (std::find(shot.kind.begin(), shot.kind.end(), 3) != shot.kind.end()) light_others(look, view, shot);
  return shot;
}

// The nearest blended surface of each pixel, like water over a basin; no fragments if there is none in the
// scene.
View veils_of(const Scene& scene, const SurfaceLook& look, const Camera& camera, const View& view) {
  if (!look.has_veils()) return {};
  return rasterise(scene, camera, view.width, view.height,
                   [&](const Fragment& f) { return look.is_veil(f); });
}

}  // namespace

Picture render_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, uint32_t width, uint32_t height, const ViewStyle& style) {
  const SurfaceLook look(imported.scene, atlas, map, style.textures);
  const uint32_t fine = style.smooth ? kSupersample : 1;
  const View view = rasterise(imported.scene, camera, width * fine, height * fine,
                              [&](const Fragment& f) { return look.visible(f); });
  return shaded_view(imported, atlas, map, camera, view, fine, style);
}

Picture shaded_view(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                    const Camera& camera, const View& view, uint32_t fine, const ViewStyle& style) {
  const SurfaceLook look(imported.scene, atlas, map, style.textures);
  const Shot shot = shade(look, view, camera);
  std::vector<float> lit;
  for (size_t i = 0; i < shot.kind.size(); ++i)
    if (shot.kind[i] == 1) lit.push_back(luminance(shot.radiance[i]));
  const float exposure = style.exposure > 0 ? style.exposure : exposure_of(std::move(lit));
  const auto displayed = [&](const Vec3& radiance) {
    Vec3 color;
    for (int c = 0; c < 3; ++c) color[c] = display(radiance[c] * exposure, style.filmic);
    return color;
  };
  const View veils = veils_of(imported.scene, look, camera, view);
  return supersampled(view.width / fine, view.height / fine, fine, [&](size_t i) {
    const Vec3 behind = shot.kind[i] == 2 ? Vec3(255, 0, 255) : displayed(shot.radiance[i]);
    if (veils.fragments.empty() || veils.fragments[i].inverse_depth <= view.fragments[i].inverse_depth)
      return behind;
    const Fragment& veil = veils.fragments[i];
    Vec3 e;
    if (!look.irradiance(veil, e)) return behind;
    const Vec4 base = look.base_color(veil);
    return behind + (displayed(Vec3(base) * e * kInvPi + look.emission(veil)) - behind) * base.w;
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

Picture preview_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                        const Camera& camera, const View& view, uint32_t fine) {
  constexpr uint32_t kGap = 8;
  const Picture scene = shaded_view(imported, atlas, map, camera, view, fine);
  const Picture sheet = atlas_picture(map, scene.height);
  Picture both(scene.width + kGap + sheet.width, scene.height, 16);
  both.paste(scene, 0, 0);
  both.paste(sheet, scene.width + kGap, 0);
  return both;
}

}  // namespace kiln
