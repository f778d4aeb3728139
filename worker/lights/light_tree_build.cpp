#include <array>
#include <numeric>

#include "common/base/check.h"
#include "worker/lights/light_tree.h"

namespace kiln {
namespace {

constexpr int kBins = 16;
constexpr int kByCost = 8;            // levels; deeper ranges are halved to bound the depth
constexpr double kWeakest = 1e-12;    // strength relative to the strongest: no product underflows
constexpr double kMargin = 1e-6;      // on cosines, for rounding to float
constexpr double kRoundUp = 1e-3;     // on radii, for rounding of distances and of points on triangles
constexpr double kCoordinate = 1e-6;  // the same, relative to the coordinates

// Summary of a range of lights for the heuristic of section 4.4.
struct Extent {
  DVec3 low{1e300}, high{-1e300}, axis{0.0};
  double strength = 0;
  uint32_t count = 0;

  void add(const LightBounds& l, double s) {
    low = glm::min(low, DVec3(l.centre) - DVec3(l.radius));
    high = glm::max(high, DVec3(l.centre) + DVec3(l.radius));
    // Lights without a direction dilute those that have one.
    if (l.cos_normals > -1.0) axis += DVec3(l.axis) * s;
    strength += s;
    ++count;
  }
  void add(const Extent& e) {
    low = glm::min(low, e.low);
    high = glm::max(high, e.high);
    axis += e.axis;
    strength += e.strength;
    count += e.count;
  }
  // Strength x size x spread of directions. Size is the squared diagonal, non-zero also for lamps in a row;
  // the spread goes from 1 (one normal) to 4 (the paper's ratio of the solid angles 4 pi and pi).
  double cost() const {
    if (count == 0) return 0;
    const DVec3 d = high - low;
    return strength * glm::dot(d, d) * (4.0 - 3.0 * std::min(1.0, glm::length(axis) / strength));
  }
};

// The axis of a two-sided light may point either way; this picks the same one for all.
Vec3 canonical(const LightBounds& l) {
  if (!l.two_sided) return l.axis;
  const float lead = l.axis.y != 0 ? l.axis.y : l.axis.x != 0 ? l.axis.x : l.axis.z;
  return lead < 0 ? -l.axis : l.axis;
}

}  // namespace

class LightTree::Builder {
 public:
  Builder(LightTree& tree, const std::vector<LightBounds>& lights) : tree_(tree), lights_(lights) {
    double strongest = 0;
    for (LightBounds& l : lights_) {
      strongest = std::max(strongest, l.strength);
      l.axis = canonical(l);
    }
    for (const LightBounds& l : lights_)
      strength_.push_back(strongest > 0 ? std::max(l.strength / strongest, kWeakest) : 1.0);
    order_.resize(lights.size());
    std::iota(order_.begin(), order_.end(), 0u);
    tree_.trails_.assign(lights.size(), 0);
    if (!lights.empty()) build(0, static_cast<uint32_t>(lights.size()), 0, 0);
  }

 private:
  struct Range {
    uint32_t begin, end;
    double cost;
    uint32_t size() const { return end - begin; }
  };
  Range range(uint32_t begin, uint32_t end) const {
    Extent e;
    for (uint32_t i = begin; i < end; ++i) e.add(lights_[order_[i]], strength_[order_[i]]);
    return {begin, end, e.cost()};
  }

  int32_t build(uint32_t begin, uint32_t end, int level, uint64_t trail) {
    std::vector<Range> parts{range(begin, end)};
    const size_t width = level == 0 ? kRootWidth : kWidth;
    while (parts.size() < width) {
      size_t widest = parts.size();
      for (size_t i = 0; i < parts.size(); ++i) {
        if (parts[i].size() < 2) continue;
        if (widest == parts.size() ||
            (level < kByCost && parts[i].cost != parts[widest].cost ? parts[i].cost > parts[widest].cost
                                                                    : parts[i].size() > parts[widest].size()))
          widest = i;
      }
      if (widest == parts.size()) break;
      const Range whole = parts[widest];
      const uint32_t middle = level < kByCost ? split(whole) : whole.begin + whole.size() / 2;
      parts[widest] = range(whole.begin, middle);
      parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(widest) + 1, range(middle, whole.end));
    }
    KILN_CHECK(level < kDeepest);
    const auto node = static_cast<int32_t>(tree_.groups_.size());
    const size_t groups = level == 0 ? (parts.size() + kLanes - 1) / kLanes : kWidth / kLanes;
    if (level == 0) tree_.root_width_ = static_cast<int>(groups * kLanes);
    tree_.groups_.resize(tree_.groups_.size() + groups);
    for (size_t slot = 0; slot < groups * kLanes; ++slot) {
      const auto lane = static_cast<int>(slot % kLanes);
      const auto group = [&]() -> Group& { return tree_.groups_[static_cast<size_t>(node) + slot / kLanes]; };
      if (slot >= parts.size()) {
        group().reach2[lane] = -1.0f;
        continue;
      }
      const int shift = level == 0 ? 0 : kRootTrailBits + kTrailBits * (level - 1);
      const uint64_t here = trail | uint64_t{slot} << shift;
      int32_t child;
      if (parts[slot].size() == 1) {
        const uint32_t light = order_[parts[slot].begin];
        tree_.trails_[light] = here;
        child = ~static_cast<int32_t>(light);
      } else {
        child = build(parts[slot].begin, parts[slot].end, level + 1, here);
      }
      group().child[lane] = child;
      enclose(parts[slot], group(), lane);
    }
    return node;
  }

  // Partitions the lights of the range at the cheapest split and returns its position.
  uint32_t split(const Range& r) {
    DVec3 low(1e300), high(-1e300);
    for (uint32_t i = r.begin; i < r.end; ++i) {
      low = glm::min(low, DVec3(lights_[order_[i]].centre));
      high = glm::max(high, DVec3(lights_[order_[i]].centre));
    }
    const DVec3 size = high - low;
    const double longest = std::max({size.x, size.y, size.z});
    double best = -1;
    int best_axis = 0, best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(size[axis] > longest * 1e-3)) continue;
      std::array<Extent, kBins> bins;
      for (uint32_t i = r.begin; i < r.end; ++i) {
        const uint32_t l = order_[i];
        bins[static_cast<size_t>(bin(l, axis, low, size))].add(lights_[l], strength_[l]);
      }
      std::array<double, kBins> right;  // cost of this bin and all later ones
      Extent sum;
      for (size_t b = kBins; b-- > 0;) {
        sum.add(bins[b]);
        right[b] = sum.cost();
      }
      sum = Extent();
      for (size_t b = 0; b + 1 < kBins; ++b) {
        sum.add(bins[b]);
        if (sum.count == 0 || sum.count == r.size()) continue;
        const double cost = (sum.cost() + right[b + 1]) * (longest / size[axis]);
        if (best < 0 || cost < best) best = cost, best_axis = axis, best_bin = static_cast<int>(b);
      }
    }
    if (best < 0) return r.begin + r.size() / 2;  // all at one position
    const auto first = order_.begin() + r.begin;
    const auto middle = std::stable_partition(
        first, order_.begin() + r.end, [&](uint32_t l) { return bin(l, best_axis, low, size) <= best_bin; });
    return static_cast<uint32_t>(middle - order_.begin());
  }
  int bin(uint32_t light, int axis, const DVec3& low, const DVec3& size) const {
    const double at = (static_cast<double>(lights_[light].centre[axis]) - low[axis]) / size[axis];
    return std::min(static_cast<int>(at * kBins), kBins - 1);
  }

  // Bounds of all lights in the range, computed from the lights: tighter than from the children's bounds.
  void enclose(const Range& r, Group& node, int slot) const {
    DVec3 sum(0.0), centroid(0.0);
    double strength = 0, cos_emission = 1;
    bool two_sided = false, anywhere = false;
    for (uint32_t i = r.begin; i < r.end; ++i) {
      const LightBounds& l = lights_[order_[i]];
      sum += DVec3(l.axis);
      strength += strength_[order_[i]];
      centroid += DVec3(l.centre) * strength_[order_[i]];
      cos_emission = std::min(cos_emission, l.cos_emission);
      two_sided = two_sided || l.two_sided;
      anywhere = anywhere || l.cos_normals <= -1.0;
    }
    const Vec3 centre(centroid / strength), axis = normalize_or(Vec3(sum), Vec3(0, 1, 0));
    double radius = 0, reach = 0, spread2 = 0, cos_normals = anywhere ? -1 : 1;
    for (uint32_t i = r.begin; i < r.end; ++i) {
      const LightBounds& l = lights_[order_[i]];
      const double away = glm::length(DVec3(l.centre) - DVec3(centre));
      // The variance of a triangle is at most a quarter of the squared radius around its centroid,
      // of a rectangle a third, of a disc a half: close enough to steer sampling.
      spread2 += (away * away + 0.25 * l.radius * l.radius) * strength_[order_[i]] / strength;
      radius = std::max(radius, away + l.radius);
      reach = std::max(reach, away + l.radius + l.reach);
      if (!anywhere) cos_normals = std::min(cos_normals, widened(l, axis, two_sided));
    }
    const DVec3 a = glm::abs(DVec3(centre));
    radius = radius * (1 + kRoundUp) + (radius > 0 ? kCoordinate * std::max({a.x, a.y, a.z}) : 0.0);
    cos_normals = std::max(-1.0, cos_normals - kMargin);
    node.x[slot] = centre.x, node.y[slot] = centre.y, node.z[slot] = centre.z;
    node.radius[slot] = static_cast<float>(radius);
    node.axis_x[slot] = axis.x, node.axis_y[slot] = axis.y, node.axis_z[slot] = axis.z;
    node.cos_normals[slot] = static_cast<float>(cos_normals);
    node.sin_normals[slot] = static_cast<float>(std::sqrt(std::max(0.0, 1 - cos_normals * cos_normals)));
    node.cos_emission[slot] = static_cast<float>(cos_emission - 10 * kMargin);
    node.fold[slot] = two_sided ? 1.0f : -1.0f;
    node.strength[slot] = static_cast<float>(strength);
    node.spread2[slot] = static_cast<float>(spread2);
    node.reach2[slot] = static_cast<float>(reach * reach * (1 + kRoundUp));
  }
  // Cosine of the angle between the axis and the normal of the light furthest from it.
  static double widened(const LightBounds& l, const Vec3& axis, bool fold) {
    double cos_t = std::clamp(glm::dot(DVec3(axis), DVec3(l.axis)), -1.0, 1.0);
    if (fold) cos_t = l.two_sided ? std::abs(cos_t) : cos_t;
    const double sin_t = std::sqrt(1 - cos_t * cos_t);
    const double sin_n = std::sqrt(std::max(0.0, 1 - l.cos_normals * l.cos_normals));
    if (sin_t * l.cos_normals + cos_t * sin_n < 0) return -1;  // more than half a turn together
    return cos_t * l.cos_normals - sin_t * sin_n;
  }

  LightTree& tree_;
  std::vector<LightBounds> lights_;
  std::vector<double> strength_;
  std::vector<uint32_t> order_;
};

LightTree::LightTree(const std::vector<LightBounds>& lights) {
  Builder(*this, lights);
}

}  // namespace kiln
