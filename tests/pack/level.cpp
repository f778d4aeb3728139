#include "tests/pack/level.h"

#include <cmath>

#include "common/raster/footprint.h"
#include "tests/atlas/shapes.h"

namespace kiln::test {
namespace {

using Fan = std::vector<DVec2>;  // triangles around the first corner

double between(Random& random, double low, double high) {
  return low + (high - low) * random.next();
}

Fan rectangle(double x, double y) {
  return {{0, 0}, {x, 0}, {x, y}, {0, y}};
}

Fan l_shape(double x, double y, Random& random) {
  const double a = x * between(random, 0.3, 0.7), b = y * between(random, 0.3, 0.7);
  return {{a, b}, {a, y}, {0, y}, {0, 0}, {x, 0}, {x, b}};
}

// Corners on an ellipse at angles that only rise. The roots of (t, 1 - t) are a point of the circle.
Fan round(double x, double y, int corners, double disorder, Random& random) {
  Fan fan;
  for (int k = 0; k < corners; ++k) {
    const double turn = 4.0 * (k + disorder * between(random, -0.5, 0.5)) / corners + 4.0;
    const int quarter = static_cast<int>(turn) % 4;
    const double t = turn - std::floor(turn), c = std::sqrt(1 - t), s = std::sqrt(t);
    const DVec2 unit = quarter == 0   ? DVec2(c, s)
                       : quarter == 1 ? DVec2(-s, c)
                       : quarter == 2 ? DVec2(-c, -s)
                                      : DVec2(s, -c);
    fan.push_back(DVec2(0.5 * x, 0.5 * y) * unit);
  }
  return fan;
}

void turn(Fan& fan, double slope) {
  const double c = 1 / std::sqrt(1 + slope * slope), s = slope * c;
  for (DVec2& p : fan) p = DVec2(c * p.x - s * p.y, s * p.x + c * p.y);
}

Fan shape(const Mix& mix, Random& random) {
  const double extent = std::min(mix.most, mix.least / std::pow(1 - random.next(), 1 / mix.fall));
  if (random.next() < mix.slivers) {
    Fan fan = rectangle(extent, extent / between(random, 8, 40));
    turn(fan, std::pow(2.0, between(random, -4, 4)) * (random.next() < 0.5 ? -1 : 1));
    return fan;
  }
  double x = extent, y = extent / between(random, 1, 3);
  if (random.next() < 0.5) std::swap(x, y);
  const double kind = random.next();
  Fan fan = kind < 0.5    ? rectangle(x, y)
            : kind < 0.65 ? l_shape(x, y, random)
            : kind < 0.80 ? round(x, y, 5 + static_cast<int>(4 * random.next()), 0.8, random)
            : kind < 0.90 ? round(x, y, 3, 0.5, random)
                          : round(x, y, 24, 0, random);
  if (random.next() < 1.0 / 3) turn(fan, std::pow(2.0, between(random, -4, 4)));
  return fan;
}

// As a chart is laid for packing: its box on texel centres, its extent rounded up to whole steps.
BitImage mask_of(Fan fan) {
  DVec2 low(fan[0]), high(fan[0]);
  for (const DVec2& p : fan) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const DVec2 steps(std::max(1.0, std::ceil(high.x - low.x)), std::max(1.0, std::ceil(high.y - low.y)));
  const DVec2 scale = steps / (high - low);
  for (DVec2& p : fan) p = (p - low) * scale + 0.5;
  BitImage mask(static_cast<uint32_t>(steps.x) + 1, static_cast<uint32_t>(steps.y) + 1);
  for (size_t k = 2; k < fan.size(); ++k)
    for_each_footprint_span({{fan[0], fan[k - 1], fan[k]}}, mask.width(), mask.height(),
                            [&](uint32_t y, uint32_t x0, uint32_t x1) { mask.set_span(y, x0, x1); });
  return mask;
}

}  // namespace

const std::vector<Mix>& mixes() {
  static const std::vector<Mix> all = {{"tiny", 1, 5, 1.5, 0.05},
                                       {"medium", 8, 48, 1.5, 0.05},
                                       {"large", 60, 400, 1.5, 0.05},
                                       {"slivers", 6, 200, 1.5, 0.9},
                                       {"everything", 1, 400, 1.0, 0.15}};
  return all;
}

Mix published_level() {
  return {"published", 1.65, 500, 1.78, 0.08};
}

MaskSet make_level(const Mix& mix, uint32_t count, uint64_t seed) {
  Random random(seed);
  MaskSet masks;
  for (uint32_t i = 0; i < count; ++i) masks.add(mask_of(shape(mix, random)));
  return masks;
}

}  // namespace kiln::test
