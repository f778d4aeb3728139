#include "coordinator/report/preview.h"

#include <algorithm>
#include <numeric>

#include "common/base/parallel.h"
#include "coordinator/imageio/imageio.h"
#include "coordinator/report/surface_look.h"

namespace kiln {
namespace {

constexpr uint32_t kSupersample = 2;  // per side

// Narkowicz 2015, ACES filmic tone mapping curve (fit), then sRGB.
uint8_t display(float x) {
  x = std::max(0.0f, x);
  const float y = (x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f);
  return static_cast<uint8_t>(std::lround(255.0f * linear_to_srgb(y)));
}

// Scale that brings the median of the positive luminances to a mid grey, but leaves the brightest twentieth
// room before the curve clips: sunlit ground beside deep shade stays readable.
float exposure_of(std::vector<float> luminances) {
  std::erase_if(luminances, [](float l) { return !(l > 0) || !std::isfinite(l); });
  if (luminances.empty()) return 1.0f;
  const auto quantile = [&](double q) {
    const auto at =
        luminances.begin() + static_cast<ptrdiff_t>(q * static_cast<double>(luminances.size() - 1));
    std::nth_element(luminances.begin(), at, luminances.end());
    return *at;
  };
  const float middle = 0.22f / quantile(0.5);
  return std::clamp(1.4f / quantile(0.95), 0.25f * middle, middle);
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
                    const Camera& camera, uint32_t width, uint32_t height) {
  const SurfaceLook look(imported.scene, atlas, map);
  const View view = rasterise(imported.scene, camera, width * kSupersample, height * kSupersample,
                              [&](const Fragment& f) { return look.visible(f); });
  const Shot shot = shade(look, view, camera);
  std::vector<float> lit;
  for (size_t i = 0; i < shot.kind.size(); ++i)
    if (shot.kind[i] == 1) lit.push_back(luminance(shot.radiance[i]));
  const float exposure = exposure_of(std::move(lit));
  Picture picture{width, height, std::vector<uint8_t>(size_t{width} * height * 3)};
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      Vec3 sum(0.0f);  // of displayed values, so that bright edges are smooth
      for (uint32_t k = 0; k < kSupersample * kSupersample; ++k) {
        const size_t i =
            (size_t{y} * kSupersample + k / kSupersample) * view.width + x * kSupersample + k % kSupersample;
        if (shot.kind[i] == 2)
          sum += Vec3(255, 0, 255);
        else
          for (int c = 0; c < 3; ++c) sum[c] += display(shot.radiance[i][c] * exposure);
      }
      for (int c = 0; c < 3; ++c)
        picture.rgb[(size_t{y} * width + x) * 3 + c] =
            static_cast<uint8_t>(sum[c] / static_cast<float>(kSupersample * kSupersample) + 0.5f);
    }
  return picture;
}

Picture atlas_picture(const Lightmap& map, uint32_t size) {
  const uint32_t pages = map.planes.height / map.page_height;
  const uint32_t across = static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(pages))));
  const uint32_t down = (pages + across - 1) / across;
  const uint32_t full_width = across * map.planes.width, full_height = down * map.page_height;
  // Shrinks by any factor, grows by whole ones: small maps show their texels.
  double step = std::max(double(full_width) / size, double(full_height) / size);
  if (step < 1) step = 1 / std::floor(1 / step);
  Picture p;
  p.width = std::max(1u, static_cast<uint32_t>(full_width / step));
  p.height = std::max(1u, static_cast<uint32_t>(full_height / step));
  p.rgb.assign(size_t{p.width} * p.height * 3, 24);
  std::vector<float> lit;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kMeasured)
      lit.push_back(luminance(Vec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t])));
  const float exposure = exposure_of(std::move(lit));
  for (uint32_t y = 0; y < p.height; ++y)
    for (uint32_t x = 0; x < p.width; ++x) {
      const auto fx = std::min(full_width - 1, static_cast<uint32_t>((x + 0.5) * step));
      const auto fy = std::min(full_height - 1, static_cast<uint32_t>((y + 0.5) * step));
      const uint32_t page = fy / map.page_height * across + fx / map.planes.width;
      if (page >= pages) continue;
      const size_t t =
          (size_t{page} * map.page_height + fy % map.page_height) * map.planes.width + fx % map.planes.width;
      if (map.validity[t] == Validity::kEmpty) continue;
      uint8_t* out = &p.rgb[(size_t{y} * p.width + x) * 3];
      if (map.validity[t] == Validity::kInside) {
        out[0] = out[2] = 255, out[1] = 0;
        continue;
      }
      for (int c = 0; c < 3; ++c) out[c] = display(map.planes.data[c][t] * exposure);
    }
  return p;
}

Status write_preview(const std::filesystem::path& path, const ImportResult& imported, const Atlas& atlas,
                     const Lightmap& map, const Camera& camera) {
  constexpr uint32_t kHeight = 720, kWidth = 1280, kGap = 8;
  const Picture view = render_view(imported, atlas, map, camera, kWidth, kHeight);
  const Picture sheet = atlas_picture(map, kHeight);
  Picture both{kWidth + kGap + sheet.width, kHeight, {}};
  both.rgb.assign(size_t{both.width} * kHeight * 3, 16);
  const auto paste = [&](const Picture& p, uint32_t left) {
    for (uint32_t y = 0; y < p.height; ++y)
      std::copy_n(&p.rgb[size_t{y} * p.width * 3], p.width * 3,
                  &both.rgb[(size_t{y} * both.width + left) * 3]);
  };
  paste(view, 0);
  paste(sheet, kWidth + kGap);
  return write_png(path, both.width, both.height, both.rgb);
}

}  // namespace kiln
