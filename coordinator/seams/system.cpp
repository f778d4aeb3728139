#include "coordinator/seams/system.h"

namespace kiln {
namespace {

constexpr double kTrustFilled = 1.0 / 64;

void sort_unique(std::vector<uint32_t>& v) {
  std::sort(v.begin(), v.end());
  v.erase(std::unique(v.begin(), v.end()), v.end());
}

// Neighbours along the axes, on the same page.
template <class Visit>
void for_each_side(const Atlas& atlas, uint32_t texel, const Visit& visit) {
  const uint32_t x = texel % atlas.width, y = texel / atlas.width % atlas.height;
  if (x > 0) visit(texel - 1);
  if (x + 1 < atlas.width) visit(texel + 1);
  if (y > 0) visit(texel - atlas.width);
  if (y + 1 < atlas.height) visit(texel + atlas.width);
}

bool connected(const Atlas& atlas, const Lightmap& map, uint32_t a, uint32_t b) {
  return atlas.owner[a] == atlas.owner[b] && is_set(map.validity[b]);
}

std::vector<uint32_t> texels_near(const Atlas& atlas, const Lightmap& map,
                                  std::span<const SeamEquation> equations, uint32_t reach) {
  std::vector<uint32_t> all;
  for (const SeamEquation& e : equations) {
    for (const Lookup& side : e.side)
      all.insert(all.end(), side.texel.begin(), side.texel.begin() + side.count);
    if (all.size() > size_t{1} << 24) sort_unique(all);
  }
  sort_unique(all);
  std::vector<uint32_t> front = all;
  for (uint32_t ring = 0; ring < reach; ++ring) {
    std::vector<uint32_t> next;
    for (const uint32_t t : front)
      for_each_side(atlas, t, [&](uint32_t n) {
        if (connected(atlas, map, t, n)) next.push_back(n);
      });
    sort_unique(next);
    front.clear();
    std::set_difference(next.begin(), next.end(), all.begin(), all.end(), std::back_inserter(front));
    const auto middle = static_cast<ptrdiff_t>(all.size());
    all.insert(all.end(), front.begin(), front.end());
    std::inplace_merge(all.begin(), all.begin() + middle, all.end());
  }
  return all;
}

}  // namespace

SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           const SeamWeights& weights) {
  SeamUnknowns u;
  u.texels = texels_near(atlas, map, equations, weights.reach);
  const auto index = [&](uint32_t texel) {
    const auto at = std::lower_bound(u.texels.begin(), u.texels.end(), texel);
    return at != u.texels.end() && *at == texel ? static_cast<uint32_t>(at - u.texels.begin())
                                                : LeastSquares::kFixed;
  };
  u.problem.diagonal.resize(u.texels.size());
  for (uint32_t i = 0; i < u.texels.size(); ++i) {
    u.problem.diagonal[i] =
        weights.value * (map.validity[u.texels[i]] == Validity::kFilled ? kTrustFilled : 1.0);
    for_each_side(atlas, u.texels[i], [&](uint32_t n) {
      if (!connected(atlas, map, u.texels[i], n)) return;
      const uint32_t j = index(n);
      if (j == LeastSquares::kFixed)
        u.problem.diagonal[i] += weights.slope;
      else if (i < j)
        u.problem.links.push_back({i, j});
    });
  }
  u.problem.link_weight = weights.slope;
  u.problem.rows.reserve(equations.size());
  for (const SeamEquation& e : equations) {
    LeastSquares::Row& row = u.problem.rows.emplace_back();
    row.weight = weights.seam * double{e.texels};
    for (int s = 0; s < 2; ++s)
      for (uint32_t k = 0; k < e.side[s].count; ++k) {
        row.unknown[row.count] = index(e.side[s].texel[k]);
        row.factor[row.count++] = s == 0 ? e.side[s].weight[k] : -e.side[s].weight[k];
      }
  }
  return u;
}

}  // namespace kiln
