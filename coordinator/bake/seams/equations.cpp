#include "coordinator/bake/seams/equations.h"

namespace kiln {
namespace {

// Twice kFootprintShrink: the weight that two axes may read outside the mask.
constexpr double kNegligible = 1.0 / 128;

struct Reader {
  const Atlas& atlas;
  std::vector<uint8_t> usable;  // set, and finite in every plane that has light

  Reader(const Atlas& a, const Lightmap& map) : atlas(a), usable(map.validity.size()) {
    for (size_t t = 0; t < usable.size(); ++t) usable[t] = is_set(map.validity[t]);
    for (size_t p = 0; p < map.planes.data.size(); ++p) {
      if (map.planes.names[p] == "error" || map.planes.names[p] == "samples") continue;
      for (size_t t = 0; t < usable.size(); ++t) usable[t] &= std::isfinite(map.planes.data[p][t]);
    }
  }

  bool read(const SeamPoint& p, int side, Lookup& out) const {
    const DVec2 limit(atlas.width - 1.0, atlas.height - 1.0);
    const DVec2 c = glm::clamp(p.texel[side] - 0.5, DVec2(0.0), limit);
    const DVec2 low = glm::min(glm::floor(c), glm::max(limit - 1.0, DVec2(0.0))), f = c - low;
    const DVec2 next = glm::min(low + 1.0, limit);
    double sum = 0, weights[4];
    for (int k = 0; k < 4; ++k) {
      const double w = (k & 1 ? f.x : 1 - f.x) * (k & 2 ? f.y : 1 - f.y);
      const auto x = static_cast<uint32_t>(k & 1 ? next.x : low.x);
      const auto y = static_cast<uint32_t>(k & 2 ? next.y : low.y);
      const size_t t = (size_t{p.page[side]} * atlas.height + y) * atlas.width + x;
      if (w == 0) continue;
      const bool own = atlas.owner[t] == p.placement[side] + 1;
      if (w < kNegligible && !(usable[t] && own)) continue;
      if (!usable[t]) return false;
      weights[out.count] = w;
      out.texel[out.count++] = static_cast<uint32_t>(t);
      sum += w;
    }
    for (uint32_t k = 0; k < out.count; ++k) out.weight[k] = static_cast<float>(weights[k] / sum);
    return true;
  }
};

}  // namespace

std::vector<SeamEquation> seam_equations(const Atlas& atlas, const Lightmap& map,
                                         std::span<const SeamPoint> points) {
  std::vector<SeamEquation> equations;
  if (points.empty()) return equations;
  const Reader reader(atlas, map);
  equations.reserve(points.size());
  for (const SeamPoint& p : points) {
    SeamEquation e;
    e.texels = static_cast<float>(p.texels);
    if (reader.read(p, 0, e.side[0]) && reader.read(p, 1, e.side[1])) equations.push_back(e);
  }
  return equations;
}

double seam_step(const SeamEquation& e, const std::vector<float>& plane) {
  const double base = plane[e.side[0].texel[0]];
  double sum[2] = {0, 0};
  for (int s = 0; s < 2; ++s)
    for (uint32_t k = 0; k < e.side[s].count; ++k)
      sum[s] += double{e.side[s].weight[k]} * (double{plane[e.side[s].texel[k]]} - base);
  return sum[0] - sum[1];
}

double seam_mean(const SeamEquation& e, const std::vector<float>& plane) {
  double sum = 0;
  for (const Lookup& side : e.side)
    for (uint32_t k = 0; k < side.count; ++k)
      sum += 0.5 * double{side.weight[k]} * double{plane[side.texel[k]]};
  return sum;
}

}  // namespace kiln
