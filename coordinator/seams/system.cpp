#include "coordinator/seams/system.h"

#include "coordinator/seams/steps.h"

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

// Mean of the stated variance over the texels of a chart around one, relative to the square of their mean.
double relative_variance_around(const Atlas& atlas, const Lightmap& map, const std::vector<float>& error,
                                uint32_t texel, double dark) {
  constexpr int kReach = 2;
  const int width = static_cast<int>(atlas.width), height = static_cast<int>(atlas.height);
  const int x = static_cast<int>(texel % atlas.width), row = static_cast<int>(texel / atlas.width);
  const int page = row / height, y = row % height;
  double squares = 0, light = 0, count = 0;
  for (int ny = std::max(0, y - kReach); ny <= std::min(height - 1, y + kReach); ++ny)
    for (int nx = std::max(0, x - kReach); nx <= std::min(width - 1, x + kReach); ++nx) {
      const auto n = (static_cast<size_t>(page) * atlas.height + static_cast<size_t>(ny)) * atlas.width +
                     static_cast<size_t>(nx);
      if (!connected(atlas, map, texel, static_cast<uint32_t>(n)) || !std::isfinite(error[n])) continue;
      squares += double{error[n]} * double{error[n]};
      light += light_of(map, n);
      ++count;
    }
  const double mean = std::max(dark, light / std::max(1.0, count));
  return count > 0 ? squares / (count * mean * mean) : 0;
}

double luminance_mean(const SeamEquation& e, const Lightmap& map) {
  const auto& d = map.planes.data;
  return luminance(DVec3(seam_mean(e, d[0]), seam_mean(e, d[1]), seam_mean(e, d[2])));
}

void add_rows(std::span<const SeamEquation> equations, SeamUnknowns& u) {
  const auto index = [&](uint32_t texel) {
    const auto at = std::lower_bound(u.texels.begin(), u.texels.end(), texel);
    return static_cast<uint32_t>(at - u.texels.begin());
  };
  u.problem.rows.reserve(equations.size());
  for (const SeamEquation& e : equations) {
    LeastSquares::Row& row = u.problem.rows.emplace_back();
    for (int s = 0; s < 2; ++s)
      for (uint32_t k = 0; k < e.side[s].count; ++k) {
        row.unknown[row.count] = index(e.side[s].texel[k]);
        row.factor[row.count++] = s == 0 ? e.side[s].weight[k] : -e.side[s].weight[k];
      }
  }
}

void measure_surroundings(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                          double dark, SeamUnknowns& u) {
  const std::vector<float>& error = map.planes.plane("error");
  std::vector<double> weight(u.texels.size(), 0.0), inverse(u.texels.size(), 0.0);
  for (size_t r = 0; r < equations.size(); ++r) {
    const double mean = std::max(dark, luminance_mean(equations[r], map));
    const LeastSquares::Row& row = u.problem.rows[r];
    for (uint32_t k = 0; k < row.count; ++k) {
      inverse[row.unknown[k]] += std::abs(double{row.factor[k]}) / mean;
      weight[row.unknown[k]] += std::abs(double{row.factor[k]});
    }
  }
  for (size_t i = 0; i < u.texels.size(); ++i) {
    u.light.push_back(weight[i] > 0 ? weight[i] / inverse[i] : std::max(dark, light_of(map, u.texels[i])));
    u.variance.push_back(relative_variance_around(atlas, map, error, u.texels[i], dark));
    u.own.push_back(light_of(map, u.texels[i]));
    u.error.push_back(std::isfinite(error[u.texels[i]]) ? std::max(0.0, double{error[u.texels[i]]}) : 0.0);
    u.variance.push_back(relative_variance_around(atlas, map, error, u.texels[i], dark));
  }
}

}  // namespace

SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           const SeamWeights& weights) {
  SeamUnknowns u;
  u.texels = texels_near(atlas, map, equations, weights.reach);
  add_rows(equations, u);
  const double dark = std::max(kDarkStep * mean_light(map), 1e-30);  // its square is a number
  measure_surroundings(atlas, map, equations, dark, u);
  std::vector<double> scale(u.texels.size());  // s_i^2
  for (size_t i = 0; i < scale.size(); ++i)
    scale[i] = (u.variance[i] + weights.model * weights.model) * u.light[i] * u.light[i];
  LeastSquares& p = u.problem;
  p.diagonal.resize(u.texels.size());
  for (uint32_t i = 0; i < u.texels.size(); ++i) {
    p.diagonal[i] =
        weights.value * (map.validity[u.texels[i]] == Validity::kFilled ? kTrustFilled : 1.0) / scale[i];
    for_each_side(atlas, u.texels[i], [&](uint32_t n) {
      if (!connected(atlas, map, u.texels[i], n)) return;
      const auto at = std::lower_bound(u.texels.begin(), u.texels.end(), n);
      const auto j = static_cast<uint32_t>(at - u.texels.begin());
      if (at == u.texels.end() || *at != n)
        p.diagonal[i] += weights.slope / scale[i];
      else if (i < j)
        p.links.push_back({i, j, 2 * weights.slope / (scale[i] + scale[j])});
    });
  }
  for (size_t r = 0; r < equations.size(); ++r) {
    LeastSquares::Row& row = p.rows[r];
    double variance = 0;
    for (uint32_t k = 0; k < row.count; ++k)
      variance += 0.5 * std::abs(double{row.factor[k]}) * scale[row.unknown[k]];
    row.weight = weights.seam * double{equations[r].texels} / variance;
  }
  return u;
}

}  // namespace kiln
