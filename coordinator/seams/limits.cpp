#include "coordinator/seams/limits.h"

#include <limits>

namespace kiln {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A point that reads less of a texel than this says nothing of the range of its values.
constexpr float kLeastPart = 1.0f / 16;
// Of a texel's own stated error: what is taken for it at most.
constexpr double kMostOfOwn = 2;
// Of a texel's light: what a footprint that is cut off sets it off by at most. More is a change within a
// texel.
constexpr double kMostOfLight = 0.5, kMostCutOff = 0.1;  // by noise; by a footprint that is cut off

struct Range {
  double low = kInfinity, high = -kInfinity;
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
  bool empty() const { return low > high; }
  double nearest_to_zero() const { return empty() ? 0 : low > 0 ? low : high < 0 ? high : 0; }
};

// What the seam points that read a texel say of it.
struct Reading {
  Range gap;                        // the other side's lookup less this one's
  Range values;                     // of texels of both sides
  double variance = 0, weight = 0;  // stated, of these
};

// What is stated of a texel in a plane: of the band that the plane is of; else of the luminance of E, as much
// relative to what the texel holds, or to what there is around it where the plane has a sign.
double stated_in_plane(const SeamUnknowns& u, size_t i, double value, const Range& values, bool is_signed,
                       const std::vector<float>* band) {
  if (band) {
    const float error = (*band)[u.texels[i]];
    return std::isfinite(error) ? std::max(0.0, double{error}) : 0;
  }
  if (is_signed) {
    const double size = values.empty() ? std::abs(value) : std::max(-values.low, values.high);
    return u.error[i] * size / std::max(u.own[i], u.light[i]);
  }
  return u.own[i] > 0 ? u.error[i] * value / u.own[i] : u.error[i];
}

// Null: the plane is of no band of which an error is stated.
const std::vector<float>* band_error_of(const Lightmap& map, size_t plane) {
  for (size_t k = 0; k < map.band_error.names.size(); ++k)
    if (map.planes.names[plane].starts_with(map.band_error.names[k])) return &map.band_error.data[k];
  return nullptr;
}

std::vector<Reading> read_points(const std::vector<float>& plane, const SeamUnknowns& u, bool is_signed,
                                 const std::vector<float>* own_error) {
  std::vector<Reading> all(u.texels.size());
  for (const LeastSquares::Row& row : u.problem.rows) {
    double lookup[2] = {0, 0}, variance = 0;
    Range values;
    for (uint32_t k = 0; k < row.count; ++k) {
      const double value = plane[u.texels[row.unknown[k]]];
      lookup[row.factor[k] < 0] += std::abs(double{row.factor[k]}) * value;
      if (std::abs(row.factor[k]) >= kLeastPart) values.add(value);
    }
    for (uint32_t k = 0; k < row.count; ++k) {
      const uint32_t i = row.unknown[k];
      const double stated = stated_in_plane(u, i, plane[u.texels[i]], values, is_signed, own_error);
      variance += 0.5 * std::abs(double{row.factor[k]}) * stated * stated;
    }
    for (uint32_t k = 0; k < row.count; ++k) {
      if (std::abs(row.factor[k]) < kLeastPart) continue;
      Reading& t = all[row.unknown[k]];
      t.gap.add(row.factor[k] < 0 ? lookup[0] - lookup[1] : lookup[1] - lookup[0]);
      t.values.add(values.low), t.values.add(values.high);
      t.variance += variance;
      t.weight += 1;
    }
  }
  for (Reading& t : all) t.variance = t.weight > 0 ? t.variance / t.weight : 0;
  return all;
}

// Values of a texel's own chart around it.
Range around(const Atlas& atlas, const Lightmap& map, const std::vector<float>& plane, uint32_t texel) {
  Range range;
  const int width = static_cast<int>(atlas.width), height = static_cast<int>(atlas.height);
  const int x = static_cast<int>(texel % atlas.width),
            y = static_cast<int>(texel / atlas.width % atlas.height);
  for (int dy = y > 0 ? -1 : 0; dy <= (y + 1 < height ? 1 : 0); ++dy)
    for (int dx = x > 0 ? -1 : 0; dx <= (x + 1 < width ? 1 : 0); ++dx) {
      const auto n = static_cast<size_t>(int64_t{texel} + int64_t{dy} * width + dx);
      if (atlas.owner[n] == atlas.owner[texel] && map.validity[n] == Validity::kMeasured) range.add(plane[n]);
    }
  return range;
}

// How much of what the points say of a texel's gap may be noise: all, and less (as the square: a step of ten
// errors is not one of noise at all) where they differ from each other or from nothing by more than noise
// lets them. Of four differences of two texels each the range is 2.9 stated errors in the mean.
double noise_part(double stated, const Range& gap) {
  constexpr double kMostSpread = 4;
  const double spread = gap.empty() ? 0 : std::max({gap.high - gap.low, gap.high, -gap.low});
  return spread > kMostSpread * stated ? std::pow(kMostSpread * stated / spread, 2) : 1;
}

}  // namespace

MoveLimits move_limits(const Atlas& atlas, const Lightmap& map, size_t plane, const SeamUnknowns& u,
                       const SeamWeights& weights) {
  const std::vector<float>& values = map.planes.data[plane];
  const std::vector<float>* const own_error = band_error_of(map, plane);
  const bool is_signed =
      std::any_of(u.texels.begin(), u.texels.end(), [&](uint32_t t) { return values[t] < 0; });
  const std::vector<Reading> readings = read_points(values, u, is_signed, own_error);
  MoveLimits limits{std::vector<double>(u.texels.size()), std::vector<double>(u.texels.size())};
  for (size_t i = 0; i < u.texels.size(); ++i) {
    const Reading& t = readings[i];
    const double value = values[u.texels[i]];
    // Of both sides, so that the darker one, which states less, is not preferred; but of a texel that states
    // next to nothing, little. What met no light knows nothing of its error.
    const double stated = std::min(std::sqrt(t.variance),
                                   kMostOfOwn * stated_in_plane(u, i, value, t.values, is_signed, own_error));
    double undecided = weights.errors * stated * noise_part(std::sqrt(t.variance), t.gap);
    if (!is_signed) undecided = std::min(undecided, kMostOfLight * value);
    const Range own = around(atlas, map, values, u.texels[i]);
    double most = own.empty() ? 0 : own.high - own.low;
    if (!is_signed) most = std::min(most, kMostCutOff * value);
    const double gap = std::clamp(weights.share * t.gap.nearest_to_zero(), -most, most);
    double low = std::min(0.0, gap) - undecided, high = std::max(0.0, gap) + undecided;
    const bool filled = map.validity[u.texels[i]] == Validity::kFilled;
    if (filled && t.values.empty()) {
      low = -std::abs(value), high = std::abs(value);
    } else if (!t.values.empty()) {
      low = filled ? t.values.low - value : std::max(low, t.values.low - undecided - value);
      high = filled ? t.values.high - value : std::min(high, t.values.high + undecided - value);
    }
    limits.low[i] = std::min(0.0, low);
    limits.high[i] = std::max(0.0, high);
  }
  return limits;
}

}  // namespace kiln
