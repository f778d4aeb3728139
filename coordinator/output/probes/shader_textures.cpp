#include "coordinator/output/probes/shader_textures.h"

#include <algorithm>
#include <cstring>

#include "common/probes/octahedral.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/output/textures/pixel_codes.h"

namespace kiln {
namespace {

constexpr uint32_t kLightTexels = 1 + static_cast<uint32_t>(kHarmonics);

// A texture of tiles of `width` x `height` texels; write(probe, x, y, texel).
template <class Write>
TextureImages tiles(TextureFormat format, size_t probes, uint32_t width, uint32_t height,
                    const Write& write) {
  const size_t size = texture_format(format).bytes;
  const size_t rows = (probes + kProbeColumns - 1) / kProbeColumns;
  TextureImages t;
  t.format = format;
  t.width = kProbeColumns * width;  // whatever their number, for the shader reckons with it
  t.height = static_cast<uint32_t>(rows * height);
  t.levels.assign(1, std::vector<Bytes>(1, Bytes(image_bytes(format, t.width, t.height))));
  Bytes& image = t.levels[0][0];
  for (size_t i = 0; i < probes; ++i)
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const size_t row = i / kProbeColumns * height + y, column = i % kProbeColumns * width + x;
        write(i, x, y, &image[size * (row * t.width + column)]);
      }
  return t;
}

// The texel of a map of side^2 that stands at (x, y) of its tile.
uint32_t inside(uint32_t side, uint32_t x, uint32_t y) {
  octahedral_inside(side, x, y);
  return y * side + x;
}

}  // namespace

ProbeTextures probe_textures(const ProbeField& f) {
  ProbeTextures out;
  out.light = tiles(TextureFormat::kRgba32Float, f.size(), kLightTexels, 1,
                    [&](size_t i, uint32_t x, uint32_t, std::byte* texel) {
                      const Vec3 v = x == 0 ? f.place[i] : f.light[i][x - 1];
                      const float rgba[4] = {v.x, v.y, v.z, x == 0 ? static_cast<float>(f.state[i]) : 0.0f};
                      std::memcpy(texel, rgba, sizeof rgba);
                    });
  if (f.irradiance.empty()) return out;
  out.irradiance = tiles(TextureFormat::kRgb9e5, f.size(), kIrradianceSide + 2, kIrradianceSide + 2,
                         [&](size_t i, uint32_t x, uint32_t y, std::byte* texel) {
                           const Vec3 e = f.irradiance[i * kIrradianceTexels + inside(kIrradianceSide, x, y)];
                           const float rgb[3] = {e.x, e.y, e.z};
                           const uint32_t bits = to_rgb9e5(rgb);
                           std::memcpy(texel, &bits, sizeof bits);
                         });
  out.distance = tiles(TextureFormat::kRg16Float, f.size(), kDistanceSide + 2, kDistanceSide + 2,
                       [&](size_t i, uint32_t x, uint32_t y, std::byte* texel) {
                         const Vec2 d = f.distance[i * kDistanceTexels + inside(kDistanceSide, x, y)];
                         const uint16_t halves[2] = {to_half(d.x), to_half(d.y)};
                         std::memcpy(texel, halves, sizeof halves);
                       });
  return out;
}

uint64_t most_textured_probes(bool visibility) {
  return uint64_t{kTextureSide / (visibility ? kDistanceSide + 2 : 1)} * kProbeColumns;
}

}  // namespace kiln
