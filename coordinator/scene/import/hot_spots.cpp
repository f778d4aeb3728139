#include "coordinator/scene/import/hot_spots.h"

#include <cstring>

namespace kiln {
namespace {

constexpr double kBright = 100, kShare = 0.1;

}  // namespace

std::optional<HotSpot> find_hot_spot(const Texture& image) {
  const auto at = [&](uint32_t x, uint32_t y) {
    Vec3 c;
    std::memcpy(&c, image.texels.data() + (size_t{y} * image.width + x) * image.texel_bytes(), sizeof c);
    return luminance(DVec3(c));
  };
  // Solid angle of a texel of row y, without cancellation at the poles.
  const auto solid_angle = [&](uint32_t y) {
    const double step = M_PI / image.height;
    return 2 * M_PI / image.width * 2 * std::sin((y + 0.5) * step) * std::sin(0.5 * step);
  };
  double total = 0;
  for (uint32_t y = 0; y < image.height; ++y) {
    double row = 0;
    for (uint32_t x = 0; x < image.width; ++x) row += at(x, y);
    total += row * solid_angle(y);
  }
  if (!(total > 0)) return std::nullopt;
  const double bright = kBright * total / (4 * M_PI);
  HotSpot spot{0, 0, Vec3(0.0f)};
  DVec3 sum(0.0);
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      const double value = at(x, y);
      if (!(value > bright)) continue;
      const double share = value * solid_angle(y) / total;
      const double theta = M_PI * (y + 0.5) / image.height, phi = 2 * M_PI * ((x + 0.5) / image.width - 0.5);
      sum += share * DVec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
      spot.share += share;
      spot.solid_angle += solid_angle(y);
    }
  if (spot.share < kShare) return std::nullopt;
  spot.direction = normalize_or(Vec3(sum), Vec3(0, 1, 0));
  return spot;
}

}  // namespace kiln
