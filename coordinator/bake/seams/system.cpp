#include "coordinator/bake/seams/system.h"

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

void add_rows(std::span<const SeamEquation> equations, std::span<const SeamDoubt> doubts,
              const SeamWeights& weights, SeamUnknowns& u) {
  const auto index = [&](uint32_t texel) {
    const auto at = std::lower_bound(u.texels.begin(), u.texels.end(), texel);
    return static_cast<uint32_t>(at - u.texels.begin());
  };
  u.problem.rows.reserve(equations.size());
  for (size_t r = 0; r < equations.size(); ++r) {
    const SeamEquation& e = equations[r];
    LeastSquares::Row& row = u.problem.rows.emplace_back();
    for (int s = 0; s < 2; ++s)
      for (uint32_t k = 0; k < e.side[s].count; ++k) {
        row.unknown[row.count] = index(e.side[s].texel[k]);
        row.factor[row.count++] = s == 0 ? e.side[s].weight[k] : -e.side[s].weight[k];
      }
    row.weight = weights.seam * double{e.texels} * doubts[r].weight;
  }
}

// Inverse mean, dominated by the darkest point that reads a texel.
std::vector<double> noise_of_texels(std::span<const SeamDoubt> doubts, const SeamUnknowns& u) {
  std::vector<double> inverse(u.texels.size(), 0.0), weight(u.texels.size(), 0.0);
  for (size_t r = 0; r < doubts.size(); ++r) {
    const LeastSquares::Row& row = u.problem.rows[r];
    for (uint32_t k = 0; k < row.count; ++k) {
      inverse[row.unknown[k]] +=
          std::abs(double{row.factor[k]}) / (doubts[r].noise * doubts[r].even * doubts[r].even);
      weight[row.unknown[k]] += std::abs(double{row.factor[k]});
    }
  }
  for (size_t i = 0; i < weight.size(); ++i) weight[i] = weight[i] > 0 ? weight[i] / inverse[i] : 0;
  return weight;
}

}  // namespace

SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           std::span<const SeamDoubt> doubts, const SeamWeights& weights) {
  SeamUnknowns u;
  u.texels = texels_near(atlas, map, equations, weights.reach);
  add_rows(equations, doubts, weights, u);
  u.noise = noise_of_texels(doubts, u);
  LeastSquares& p = u.problem;
  p.diagonal.resize(u.texels.size());
  for (uint32_t i = 0; i < u.texels.size(); ++i) {
    p.diagonal[i] = weights.value * (map.validity[u.texels[i]] == Validity::kFilled ? kTrustFilled : 1.0);
    for_each_side(atlas, u.texels[i], [&](uint32_t n) {
      if (!connected(atlas, map, u.texels[i], n)) return;
      const auto at = std::lower_bound(u.texels.begin(), u.texels.end(), n);
      const auto j = static_cast<uint32_t>(at - u.texels.begin());
      if (at == u.texels.end() || *at != n)
        p.diagonal[i] += weights.slope;
      else if (i < j)
        p.links.push_back({i, j, weights.slope});
    });
  }
  return u;
}

void leave_out(const Lightmap& map, std::span<const SeamEquation> equations,
               std::span<const SeamDoubt> doubts, const SeamWeights& weights, SeamUnknowns& unknowns) {
  std::vector<std::vector<double>> target(1, std::vector<double>(equations.size(), 0.0));
  for (size_t r = 0; r < equations.size(); ++r) {
    DVec3 step;
    for (int c = 0; c < 3; ++c) step[c] = seam_step(equations[r], map.planes.data[static_cast<size_t>(c)]);
    target[0][r] = doubts[r].closed * luminance(step);
  }
  for (uint32_t round = 0; round < weights.rounds; ++round) {
    const std::vector<double> c = solve(unknowns.problem, target).corrections[0];
    bool any = false;
    for (LeastSquares::Row& row : unknowns.problem.rows) {
      double most = 0;  // squared; texels read with small weights count less
      for (uint32_t k = 0; row.weight > 0 && k < row.count; ++k)
        most = std::max(most, std::abs(double{row.factor[k]}) * c[row.unknown[k]] * c[row.unknown[k]] /
                                  unknowns.noise[row.unknown[k]]);
      if (most <= weights.most * weights.most) continue;
      row.weight *= std::max(0.0, 2 - std::sqrt(most) / weights.most);
      any = true;
    }
    if (!any) return;
  }
}

}  // namespace kiln
