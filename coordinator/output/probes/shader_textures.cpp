#include "coordinator/output/probes/shader_textures.h"

#include <algorithm>
#include <cstring>

#include "common/probes/octahedral.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/output/textures/pixel_codes.h"

namespace kiln {
namespace {

constexpr uint32_t kLightTexels = 1 + static_cast<uint32_t>(kHarmonics);
constexpr uint32_t kIrradianceTile = kIrradianceSide + 2, kDistanceTile = kDistanceSide + 2;

// Tiles in a row of a map: as in the masters, unless they would be too many below each other.
size_t columns_of(size_t probes, uint32_t tile) {
  const size_t fit = size_t{kProbeColumns} * (kTextureSide / tile);
  return probes <= fit ? kProbeColumns : kTextureSide / tile;
}

// A texture of `columns` tiles of `width` x `height` texels in a row, however few there are: the shader
// reckons with it. write(probe, x, y, texel).
template <class Write>
TextureImages tiles(TextureFormat format, size_t probes, size_t columns, uint32_t width, uint32_t height,
                    const Write& write) {
  const size_t size = texture_format(format).bytes;
  const size_t rows = (probes + columns - 1) / columns;
  TextureImages t;
  t.format = format;
  t.width = static_cast<uint32_t>(columns * width);
  t.height = static_cast<uint32_t>(rows * height);
  t.levels.assign(1, std::vector<Bytes>(1, Bytes(image_bytes(format, t.width, t.height))));
  Bytes& image = t.levels[0][0];
  for (size_t i = 0; i < probes; ++i)
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const size_t row = i / columns * height + y, column = i % columns * width + x;
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
  out.light = tiles(TextureFormat::kRgba32Float, f.size(), kProbeColumns, kLightTexels, 1,
                    [&](size_t i, uint32_t x, uint32_t, std::byte* texel) {
                      const Vec3 v = x == 0 ? f.place[i] : f.light[i][x - 1];
                      const float rgba[4] = {v.x, v.y, v.z, x == 0 ? static_cast<float>(f.state[i]) : 0.0f};
                      std::memcpy(texel, rgba, sizeof rgba);
                    });
  if (f.irradiance.empty()) return out;
  out.irradiance =
      tiles(TextureFormat::kRgb9e5, f.size(), columns_of(f.size(), kIrradianceTile), kIrradianceTile,
            kIrradianceTile, [&](size_t i, uint32_t x, uint32_t y, std::byte* texel) {
              const Vec3 e = f.irradiance[i * kIrradianceTexels + inside(kIrradianceSide, x, y)];
              const float rgb[3] = {e.x, e.y, e.z};
              const uint32_t bits = to_rgb9e5(rgb);
              std::memcpy(texel, &bits, sizeof bits);
            });
  out.distance = tiles(TextureFormat::kRg16Float, f.size(), columns_of(f.size(), kDistanceTile),
                       kDistanceTile, kDistanceTile, [&](size_t i, uint32_t x, uint32_t y, std::byte* texel) {
                         const Vec2 d = f.distance[i * kDistanceTexels + inside(kDistanceSide, x, y)];
                         const uint16_t halves[2] = {to_half(d.x), to_half(d.y)};
                         std::memcpy(texel, halves, sizeof halves);
                       });
  return out;
}

uint64_t most_textured_probes(bool visibility) {
  constexpr uint64_t kLight = uint64_t{kTextureSide} * kProbeColumns, kAcross = kTextureSide / kDistanceTile;
  return visibility ? std::min(kLight, kAcross * kAcross) : kLight;
}

uint64_t texture_bytes_of_probe(bool visibility) {
  const uint64_t light = image_bytes(TextureFormat::kRgba32Float, kLightTexels, 1);
  if (!visibility) return light;
  return light + image_bytes(TextureFormat::kRgb9e5, kIrradianceTile, kIrradianceTile) +
         image_bytes(TextureFormat::kRg16Float, kDistanceTile, kDistanceTile);
}

}  // namespace kiln
