#include "coordinator/bake/seams/doubt.h"

#include <limits>

#include "coordinator/bake/seams/steps.h"

namespace kiln {
namespace {

// The light of a point is the power mean of its texels with exponent -kDarkCounts, dominated by the darkest.
constexpr double kDarkCounts = 4;
// Upper bound on what noise alone adds to Surroundings::change, in units of its variance.
constexpr double kNoiseOfChange = 6;

// The reported error of E, or of a band of the basis, and the planes it covers.
struct Stated {
  const std::vector<float>* error = nullptr;
  std::vector<std::pair<size_t, double>> planes;  // with their colour's weight in the luminance
};

std::vector<Stated> stated_of(const Lightmap& map) {
  const auto of = [&](const std::string& prefix, const std::vector<float>& error) {
    Stated s{&error, {}};
    for (size_t p = 0; p < map.planes.names.size(); ++p) {
      const std::string& name = map.planes.names[p];
      if (!name.starts_with(prefix)) continue;
      for (int c = 0; c < 3; ++c) {
        DVec3 one(0.0);
        one[c] = 1;
        if (name.ends_with(std::string(".") + "RGB"[c])) s.planes.emplace_back(p, luminance(one));
      }
    }
    return s;
  };
  std::vector<Stated> all{of("E.", map.planes.plane("error"))};
  for (size_t band = 0; band < map.band_error.data.size(); ++band)
    all.push_back(of(map.band_error.names[band], map.band_error.data[band]));
  return all;
}

// Around a lookup: the light, and the variance by reported error relative to its square.
struct Surroundings {
  double light = 0;
  std::array<double, 3> variance{};
  double slope = 0;   // the largest difference to a neighbour
  double change = 0;  // squared change of light between texels, without the linear part
};

// The two sides' difference at a seam point.
struct Difference {
  double light = 0;
  std::array<double, 3> variance{}, square{};  // relative, as reported; squared step
  double step = 0;                             // luminance, side 0 minus side 1
  double slope = 0, change = 0;                // as Surroundings', the larger of both sides
  double agreed = 0;  // part of the step that all points reading the same texels share
};

// Standard deviation of a step if texels have independent noise of equal size. Where a chart meets itself
// within a texel, both sides read nearly the same texels and noise makes no step.
double noise_of_step(const SeamEquation& e) {
  double square = 0;
  const auto common = [&](int s, uint32_t k) {  // the other side's weight of the same texel
    for (uint32_t j = 0; j < e.side[1 - s].count; ++j)
      if (e.side[1 - s].texel[j] == e.side[s].texel[k]) return double{e.side[1 - s].weight[j]};
    return 0.0;
  };
  for (int s = 0; s < 2; ++s)
    for (uint32_t k = 0; k < e.side[s].count; ++k) {
      const double other = common(s, k), weight = double{e.side[s].weight[k]} - other;
      square += weight * weight * (other > 0 ? 0.5 : 1);  // a common texel occurs on both sides
    }
  return std::sqrt(std::max(1e-6, square));
}

class Doubts {
 public:
  Doubts(const Atlas& atlas, const Lightmap& map, const DoubtSettings& settings)
      : atlas_(atlas),
        map_(map),
        settings_(settings),
        stated_(stated_of(map)),
        dark_(std::max(kDarkStep * mean_light(map), 1e-30)) {}  // its square does not underflow

  std::vector<SeamDoubt> run(std::span<const SeamEquation> equations) const {
    std::vector<uint32_t> texels;
    texels.reserve(4 * equations.size());
    for (const SeamEquation& e : equations)
      for (const Lookup& side : e.side)
        texels.insert(texels.end(), side.texel.begin(), side.texel.begin() + side.count);
    std::sort(texels.begin(), texels.end());
    texels.erase(std::unique(texels.begin(), texels.end()), texels.end());
    std::vector<Surroundings> around(texels.size());
    for (size_t i = 0; i < texels.size(); ++i) around[i] = surroundings(texels[i]);
    const auto read = [&](const Lookup& lookup) {
      Surroundings s;
      for (uint32_t k = 0; k < lookup.count; ++k) {
        const auto at = std::lower_bound(texels.begin(), texels.end(), lookup.texel[k]);
        const Surroundings& one = around[static_cast<size_t>(at - texels.begin())];
        s.light += double{lookup.weight[k]} * one.light;
        s.slope += double{lookup.weight[k]} * one.slope;
        s.change += double{lookup.weight[k]} * one.change;
        for (size_t g = 0; g < stated_.size(); ++g)
          s.variance[g] += double{lookup.weight[k]} * one.variance[g];
      }
      return s;
    };
    std::vector<Difference> differences;
    differences.reserve(equations.size());
    for (const SeamEquation& e : equations)
      differences.push_back(difference(e, {read(e.side[0]), read(e.side[1])}));
    agree(equations, texels, differences);
    std::array<double, 3> kept{};
    for (size_t g = 0; g < stated_.size(); ++g) kept[g] = noise_kept(differences, g);
    std::vector<SeamDoubt> doubts;
    doubts.reserve(equations.size());
    for (const Difference& d : differences) doubts.push_back(doubt(d, kept));
    return doubts;
  }

 private:
  // Means over 5 x 5 texels of the chart, because light and reported error of a single texel are correlated.
  Surroundings surroundings(uint32_t texel) const {
    constexpr int kReach = 2;
    const int width = static_cast<int>(atlas_.width), height = static_cast<int>(atlas_.height);
    const int x = static_cast<int>(texel % atlas_.width), row = static_cast<int>(texel / atlas_.width);
    const int page = row / height, y = row % height;
    Surroundings s;
    double count = 0;
    for (int ny = std::max(0, y - kReach); ny <= std::min(height - 1, y + kReach); ++ny)
      for (int nx = std::max(0, x - kReach); nx <= std::min(width - 1, x + kReach); ++nx) {
        const auto n = (static_cast<size_t>(page) * atlas_.height + static_cast<size_t>(ny)) * atlas_.width +
                       static_cast<size_t>(nx);
        if (atlas_.owner[n] != atlas_.owner[texel] || !is_set(map_.validity[n])) continue;
        s.light += light_of(map_, n);
        for (size_t g = 0; g < stated_.size(); ++g) {
          const double error = (*stated_[g].error)[n];
          if (std::isfinite(error)) s.variance[g] += error * error;
        }
        ++count;
      }
    s.light = std::max(dark_, s.light / std::max(1.0, count));
    for (double& v : s.variance) v /= std::max(1.0, count) * s.light * s.light;
    measure_change(texel, s);
    return s;
  }

  // The light follows the darkest texels (kDarkCounts): error in the sun does not excuse a step in the dark.
  Difference difference(const SeamEquation& e, const std::array<Surroundings, 2>& side) const {
    Difference d;
    const double size = noise_of_step(e);
    double inverse = 0;
    for (const Lookup& lookup : e.side)
      for (uint32_t k = 0; k < lookup.count; ++k)
        inverse += 0.5 * double{lookup.weight[k]} /
                   std::pow(std::max(dark_, light_of(map_, lookup.texel[k])), kDarkCounts);
    d.light = std::pow(inverse, -1 / kDarkCounts);
    DVec3 step;
    for (int c = 0; c < 3; ++c) step[c] = seam_step(e, map_.planes.data[static_cast<size_t>(c)]);
    d.step = luminance(step);
    d.slope = std::max(side[0].slope, side[1].slope);
    d.change = std::max(side[0].change, side[1].change);
    for (size_t g = 0; g < stated_.size(); ++g) {
      d.variance[g] = 0.5 * (side[0].variance[g] + side[1].variance[g]);
      for (const auto& [plane, share] : stated_[g].planes) {
        const double step = seam_step(e, map_.planes.data[plane]) / size;
        d.square[g] += share * step * step;
      }
    }
    return d;
  }

  // The smallest step over all points that read a texel, if all have one sign; for a point, the smallest over
  // its texels.
  static void agree(std::span<const SeamEquation> equations, const std::vector<uint32_t>& texels,
                    std::vector<Difference>& differences) {
    constexpr float kMinPart = 1.0f / 16;  // a smaller weight says nothing about the texel
    struct Range {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      double agreed() const { return low > 0 ? low : high < 0 ? -high : 0; }
    };
    std::vector<Range> ranges(texels.size());
    const auto for_each = [&](size_t r, const auto& visit) {
      for (int s = 0; s < 2; ++s)
        for (uint32_t k = 0; k < equations[r].side[s].count; ++k) {
          if (equations[r].side[s].weight[k] < kMinPart) continue;
          const auto at = std::lower_bound(texels.begin(), texels.end(), equations[r].side[s].texel[k]);
          visit(ranges[static_cast<size_t>(at - texels.begin())], s == 0 ? 1.0 : -1.0);
        }
    };
    for (size_t r = 0; r < equations.size(); ++r)
      for_each(r, [&](Range& range, double sign) {
        range.low = std::min(range.low, sign * differences[r].step);
        range.high = std::max(range.high, sign * differences[r].step);
      });
    for (size_t r = 0; r < equations.size(); ++r) {
      Difference& d = differences[r];
      d.agreed = std::abs(d.step);
      for_each(r, [&](const Range& range, double) { d.agreed = std::min(d.agreed, range.agreed()); });
    }
  }

  // The texel `steps` further along the row or column, if it is set and on the same chart.
  bool beside(uint32_t texel, int dx, int dy, uint32_t& out) const {
    const auto width = static_cast<int64_t>(atlas_.width), height = static_cast<int64_t>(atlas_.height);
    const int64_t x = texel % width + dx, y = texel / width % height + dy;
    if (x < 0 || y < 0 || x >= width || y >= height) return false;
    out = static_cast<uint32_t>(int64_t{texel} + dy * width + dx);
    return atlas_.owner[out] == atlas_.owner[texel] && is_set(map_.validity[out]);
  }

  // Distance of a texel from the line through two others of its row or column, around it or on one side; with
  // only two texels, their difference.
  void measure_change(uint32_t texel, Surroundings& s) const {
    const double own = light_of(map_, texel);
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
      uint32_t a = 0, b = 0, next = 0;
      const bool before = beside(texel, -dx, -dy, a), after = beside(texel, dx, dy, b);
      const double low = before ? light_of(map_, a) : own, high = after ? light_of(map_, b) : own;
      double off = own - (before ? low : high);
      if (before && after)
        off = own - 0.5 * (low + high);
      else if (after && beside(texel, 2 * dx, 2 * dy, next))
        off = 0.5 * (own + light_of(map_, next)) - high;
      else if (before && beside(texel, -2 * dx, -2 * dy, next))
        off = 0.5 * (own + light_of(map_, next)) - low;
      s.slope = std::max({s.slope, std::abs(own - low), std::abs(own - high)});
      s.change = std::max(s.change, off * off);
    }
  }

  // The share of the reported variance that the two sides do not have in common, from the lower quartile of
  // all steps: the upper half is useless where the light itself has many steps.
  double noise_kept(std::span<const Difference> differences, size_t g) const {
    constexpr double kQuartile = 0.1015;  // of the square of a normal variable
    std::vector<double> squares;
    squares.reserve(differences.size());
    for (const Difference& d : differences)
      if (d.variance[g] > 0) squares.push_back(d.square[g] / (d.variance[g] * d.light * d.light));
    if (squares.empty()) return 1;
    const auto quarter = squares.begin() + static_cast<ptrdiff_t>(squares.size() / 4);
    std::nth_element(squares.begin(), quarter, squares.end());
    return std::min(1.0, *quarter / kQuartile);
  }

  SeamDoubt doubt(const Difference& d, const std::array<double, 3>& kept) const {
    SeamDoubt out;
    for (size_t g = 0; g < stated_.size(); ++g) {
      const double light = d.light * d.light,
                   cut_off = std::min({2 * d.agreed, 2 * d.slope, settings_.cut_off * d.light});
      const double noise =
          std::pow(std::sqrt(light * (kept[g] * d.variance[g] + settings_.model * settings_.model)) +
                       cut_off / settings_.close,
                   2);
      if (g == 0) out.noise = noise;
      out.excess = std::max(out.excess, std::sqrt(d.square[g] / noise));
    }
    const double light = settings_.change * settings_.change *
                         (d.change - kNoiseOfChange * std::max(out.noise, d.variance[0] * d.light * d.light));
    out.even = light > out.noise ? out.noise / light : 1;
    out.closed = out.even * (out.excess > settings_.close ? settings_.close / out.excess : 1);
    out.weight = std::clamp((settings_.part - out.excess) / (settings_.part - settings_.close), 0.0, 1.0);
    return out;
  }

  const Atlas& atlas_;
  const Lightmap& map_;
  const DoubtSettings& settings_;
  std::vector<Stated> stated_;
  double dark_;
};

}  // namespace

std::vector<SeamDoubt> seam_doubts(const Atlas& atlas, const Lightmap& map,
                                   std::span<const SeamEquation> equations, const DoubtSettings& settings) {
  return Doubts(atlas, map, settings).run(equations);
}

}  // namespace kiln
