#include "coordinator/bake/post/across.h"

#include <cmath>

#include "coordinator/bake/seams/match.h"

namespace kiln {
namespace {

// The four texels of a bilinear lookup on a page and their weights.
template <class Visit>
void for_each_read(const Atlas& atlas, uint32_t page, const DVec2& at, const Visit& visit) {
  const DVec2 limit(atlas.width - 1.0, atlas.height - 1.0), c = glm::clamp(at - 0.5, DVec2(0.0), limit);
  const DVec2 low = glm::floor(c), f = c - low;
  for (int k = 0; k < 4; ++k) {
    const double w = (k & 1 ? f.x : 1 - f.x) * (k & 2 ? f.y : 1 - f.y);
    if (w == 0) continue;
    const auto x = static_cast<size_t>(low.x) + (k & 1), y = static_cast<size_t>(low.y) + (k >> 1);
    visit((size_t{page} * atlas.height + y) * atlas.width + x, w);
  }
}

// A texel read by a seam point on the side of a chart without a value.
struct Wanted {
  uint32_t texel, point;
  int side;
  auto operator<=>(const Wanted&) const = default;
};

class Crossing {
 public:
  Crossing(Lightmap& map, const Atlas& atlas) : map_(map), atlas_(atlas), known_(atlas.placements.size(), 0) {
    for (const uint32_t owner : atlas.owner)
      if (owner > known_.size()) known_.resize(owner, 0);
    for (size_t t = 0; t < atlas.owner.size(); ++t)
      if (atlas.owner[t] && is_set(map.validity[t])) known_[atlas.owner[t] - 1] = 1;
  }
  bool lacks(uint32_t placement) const { return !known_[placement]; }

  // True if anything was filled.
  bool fill(std::span<const SeamPoint> points) {
    std::vector<Wanted> wanted;
    for (uint32_t i = 0; i < points.size(); ++i)
      for (int side = 0; side < 2; ++side) {
        if (!lacks(points[i].placement[side]) || lacks(points[i].placement[1 - side])) continue;
        for_each_read(atlas_, points[i].page[side], points[i].texel[side], [&](size_t t, double) {
          if (atlas_.owner[t] == points[i].placement[side] + 1)
            wanted.push_back({static_cast<uint32_t>(t), i, side});
        });
      }
    std::sort(wanted.begin(), wanted.end());
    std::vector<uint32_t> filled;
    for (size_t i = 0, end; i < wanted.size(); i = end) {
      for (end = i; end < wanted.size() && wanted[end].texel == wanted[i].texel;) ++end;
      if (fill_texel(points, std::span(wanted).subspan(i, end - i))) filled.push_back(wanted[i].texel);
    }
    for (const uint32_t t : filled) {
      map_.validity[t] = Validity::kFilled;
      known_[atlas_.owner[t] - 1] = 1;
    }
    return !filled.empty();
  }

 private:
  // The mean of the other side's lookups at the points that read the texel.
  bool fill_texel(std::span<const SeamPoint> points, std::span<const Wanted> wanted) {
    std::vector<double> sums(map_.planes.data.size(), 0.0);
    double total = 0;
    for (const Wanted& at : wanted) {
      const SeamPoint& p = points[at.point];
      const int other = 1 - at.side;
      for_each_read(atlas_, p.page[other], p.texel[other], [&](size_t t, double w) {
        if (atlas_.owner[t] != p.placement[other] + 1 || !is_set(map_.validity[t])) return;
        for (size_t k = 0; k < sums.size(); ++k) sums[k] += w * double{map_.planes.data[k][t]};
        total += w;
      });
    }
    if (!(total > 0)) return false;
    const size_t samples = map_.planes.index("samples");
    for (size_t k = 0; k < sums.size(); ++k)
      if (k != samples) map_.planes.data[k][wanted[0].texel] = static_cast<float>(sums[k] / total);
    return true;
  }

  Lightmap& map_;
  const Atlas& atlas_;
  std::vector<uint8_t> known_;  // by placement: has a texel that is set
};

}  // namespace

bool fill_across_seams(Lightmap& map, SeamFinder& seams) {
  return Crossing(map, seams.atlas()).fill(seams.find().points);
}

}  // namespace kiln
