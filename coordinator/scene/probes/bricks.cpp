#include "coordinator/scene/probes/bricks.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

// Whether a triangle meets a box: no axis separates them (Akenine-Moeller 2001, Fast 3D Triangle-Box Overlap
// Testing).
bool meets(const SolidTriangle& t, const DVec3& middle, const DVec3& half) {
  const DVec3 v[3] = {t.corner[0] - middle, t.corner[1] - middle, t.corner[2] - middle};
  const DVec3 edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const auto apart = [&](const DVec3& axis) {
    const double p[3] = {dot(v[0], axis), dot(v[1], axis), dot(v[2], axis)};
    const double reach = half.x * std::abs(axis.x) + half.y * std::abs(axis.y) + half.z * std::abs(axis.z);
    return std::min({p[0], p[1], p[2]}) > reach || std::max({p[0], p[1], p[2]}) < -reach;
  };
  const DVec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const DVec3& axis : axes)
    if (apart(axis)) return false;
  if (apart(cross(edges[0], edges[1]))) return false;
  for (const DVec3& edge : edges)
    for (const DVec3& axis : axes)
      if (apart(cross(axis, edge))) return false;
  return true;
}

constexpr uint32_t kNobody = 0xffffffffu;

// Bits of a coordinate spread so that three of them interleave.
uint64_t spread(uint64_t x) {
  uint64_t out = 0;
  for (int bit = 0; bit < 21; ++bit) out |= (x >> bit & 1) << (3 * bit);
  return out;
}
uint64_t morton(const UVec3& p) {
  return spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2;
}

class Layout {
 public:
  Layout(ProbeVolume& volume, const ProbeBox& box, std::span<const SolidTriangle> triangles, uint64_t most)
      : volume_(volume), box_(box), triangles_(triangles), most_bricks_(8 * most + 64) {}

  // Returns false where there are more bricks than that many probes could need.
  bool run() {
    std::vector<std::vector<uint32_t>> near(volume_.bricks.size());
    for (uint32_t t = 0; t < triangles_.size(); ++t) sort_in(t, near);
    for (uint32_t i = 0; i < near.size(); ++i)
      if (!refine(i, std::move(near[i]))) return false;
    if (!balance()) return false;
    mark_coarser();
    return true;
  }

 private:
  void sort_in(uint32_t t, std::vector<std::vector<uint32_t>>& near) const {
    DVec3 low = triangles_[t].corner[0], high = low;
    for (const DVec3& c : triangles_[t].corner) low = glm::min(low, c), high = glm::max(high, c);
    UVec3 first, last;
    const double root = volume_.root_size() * volume_.spacing, grow = root / kBrickCells;
    for (int k = 0; k < 3; ++k) {
      const double from = std::floor((low[k] - grow - volume_.low[k]) / root),
                   to = std::floor((high[k] + grow - volume_.low[k]) / root);
      if (to < 0 || from >= volume_.roots[k]) return;
      first[k] = static_cast<uint32_t>(std::max(0.0, from));
      last[k] = static_cast<uint32_t>(std::min(to, volume_.roots[k] - 1.0));
    }
    for (uint32_t z = first.z; z <= last.z; ++z)
      for (uint32_t y = first.y; y <= last.y; ++y)
        for (uint32_t x = first.x; x <= last.x; ++x) {
          const uint32_t i = x + volume_.roots.x * (y + volume_.roots.y * z);
          if (is_near(t, volume_.bricks[i])) near[i].push_back(t);
        }
  }

  bool is_near(uint32_t triangle, const ProbeBrick& b) const {
    const double spacing = volume_.spacing_of(b), half = 0.5 * kBrickCells * spacing;
    return meets(triangles_[triangle], volume_.place(b.corner) + DVec3(half), DVec3(half + spacing));
  }

  // Beside the box that was asked for: in the part of a coarsest brick that stands out of it.
  bool is_outside(const ProbeBrick& b) const {
    const DVec3 low = volume_.place(b.corner), high = low + DVec3(kBrickCells * volume_.spacing_of(b));
    for (int k = 0; k < 3; ++k)
      if (low[k] >= box_.high[k] || high[k] <= box_.low[k]) return true;
    return false;
  }

  bool refine(uint32_t index, std::vector<uint32_t> near) {
    if (volume_.bricks[index].level == 0 || near.empty() || is_outside(volume_.bricks[index])) return true;
    if (!split(index)) return false;
    for (uint32_t k = 0; k < 8; ++k) {
      const uint32_t child = volume_.bricks[index].children + k;
      std::vector<uint32_t> of_child;
      for (const uint32_t t : near)
        if (is_near(t, volume_.bricks[child])) of_child.push_back(t);
      if (!refine(child, std::move(of_child))) return false;
    }
    return true;
  }

  bool split(uint32_t index) {
    if (volume_.bricks.size() + 8 > most_bricks_) return false;
    const ProbeBrick parent = volume_.bricks[index];
    KILN_CHECK(parent.level > 0 && !parent.children);
    volume_.bricks[index].children = static_cast<uint32_t>(volume_.bricks.size());
    for (uint32_t k = 0; k < 8; ++k) {
      ProbeBrick b;
      b.level = parent.level - 1;
      b.corner = parent.corner + UVec3(k & 1, k >> 1 & 1, k >> 2) * b.size();
      b.parent = index;
      volume_.bricks.push_back(b);
    }
    return true;
  }

  // The brick that fills the neighbour's place of this size or a larger one around it; kNobody outside.
  uint32_t neighbour(const ProbeBrick& b, int x, int y, int z) const {
    const int step[3] = {x, y, z};
    DVec3 at;
    for (int k = 0; k < 3; ++k) {
      at[k] = b.corner[k] + b.size() * (0.5 + step[k]);
      if (at[k] < 0 || at[k] > static_cast<double>(volume_.root_size()) * volume_.roots[k]) return kNobody;
    }
    uint32_t found = find_brick(volume_, at);
    while (volume_.bricks[found].level < b.level) found = volume_.bricks[found].parent;
    return found;
  }
  template <class Visit>
  void for_each_neighbour(const ProbeBrick& b, const Visit& visit) const {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (x || y || z)
            if (const uint32_t n = neighbour(b, x, y, z); n != kNobody)
              visit(n, static_cast<uint32_t>((x + 1) + 3 * (y + 1) + 9 * (z + 1)));
  }

  // Splits neighbours that are coarser by more than a level until there are none.
  bool balance() {
    for (bool changed = true; changed;) {
      changed = false;
      for (uint32_t i = 0; i < volume_.bricks.size(); ++i) {  // also those that are added
        const ProbeBrick b = volume_.bricks[i];
        if (b.children) continue;
        std::vector<uint32_t> too_coarse;
        for_each_neighbour(b, [&](uint32_t n, uint32_t) {
          if (volume_.bricks[n].level > b.level + 1) too_coarse.push_back(n);
        });
        std::sort(too_coarse.begin(), too_coarse.end());
        too_coarse.erase(std::unique(too_coarse.begin(), too_coarse.end()), too_coarse.end());
        for (const uint32_t n : too_coarse)
          if (!split(n)) return false;
        changed |= !too_coarse.empty();
      }
    }
    return true;
  }

  void mark_coarser() {
    for (ProbeBrick& b : volume_.bricks)
      for_each_neighbour(b, [&](uint32_t n, uint32_t bit) {
        if (volume_.bricks[n].level > b.level) b.coarser |= 1u << bit;
      });
  }

  ProbeVolume& volume_;
  const ProbeBox& box_;
  std::span<const SolidTriangle> triangles_;
  uint64_t most_bricks_;
};

UVec3 point_of(const ProbeBrick& b, uint32_t k) {
  return b.corner +
         UVec3(k % kBrickSide, k / kBrickSide % kBrickSide, k / (kBrickSide * kBrickSide)) * (1u << b.level);
}

// Numbers the points of all bricks.
bool number_points(PlacedVolume& out, uint32_t first_probe, uint64_t most) {
  std::vector<std::pair<uint64_t, UVec3>> points;
  for (const ProbeBrick& b : out.volume.bricks)
    if (!b.children)
      for (uint32_t k = 0; k < kBrickProbes; ++k) points.emplace_back(morton(point_of(b, k)), point_of(b, k));
  const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; }),
               points.end());
  if (points.size() > most) return false;
  out.finest.assign(points.size(), 255);
  out.coarsest.assign(points.size(), 0);
  for (const auto& p : points) out.points.push_back(p.second);
  for (ProbeBrick& b : out.volume.bricks)
    for (uint32_t k = 0; k < kBrickProbes; ++k) {
      const auto at =
          std::lower_bound(points.begin(), points.end(), std::pair(morton(point_of(b, k)), UVec3(0)), before);
      KILN_CHECK(at != points.end() && at->second == point_of(b, k));
      const auto index = static_cast<size_t>(at - points.begin());
      b.probes[k] = first_probe + static_cast<uint32_t>(index);
      if (b.children) continue;
      out.finest[index] = std::min(out.finest[index], static_cast<uint8_t>(b.level));
      out.coarsest[index] = std::max(out.coarsest[index], static_cast<uint8_t>(b.level));
    }
  return true;
}

}  // namespace

std::vector<SolidTriangle> world_triangles(const Scene& scene) {
  std::vector<SolidTriangle> out;
  for (const Instance& i : scene.instances) {
    if (!i.cast) continue;
    const Mesh& m = scene.meshes[i.mesh];
    for (const UVec3& t : m.triangles) {
      SolidTriangle w;
      for (int c = 0; c < 3; ++c) w.corner[c] = DVec3(transform_point(i.to_world, m.positions[t[c]]));
      out.push_back(w);
    }
  }
  return out;
}

Expected<PlacedVolume> place_bricks(const ProbeBox& box, std::span<const SolidTriangle> triangles,
                                    uint32_t first_probe, uint64_t most, bool centred) {
  const auto too_many = [&] {
    return fail(
        ErrorKind::kInvalidInput,
        text("probe volume '{}': spacing {:g} m needs more than {} probes: give it a larger spacing or "
             "a smaller box, or raise --max-probes",
             box.name, box.spacing, most));
  };
  PlacedVolume out;
  ProbeVolume& v = out.volume;
  v.name = box.name;
  v.low = box.low;
  v.spacing = box.spacing;
  v.visibility = box.visibility;
  v.node = box.node;
  while (v.levels < kMaxProbeLevels && box.spacing * static_cast<double>(1u << v.levels) <= box.max_spacing)
    ++v.levels;
  double bricks = 1;
  for (int k = 0; k < 3; ++k) {
    const double count = std::ceil((box.high[k] - box.low[k]) / (v.root_size() * v.spacing) * (1 - 1e-9));
    bricks *= std::max(1.0, count);
    // Coordinates of points have 21 bits in their order.
    if (!(bricks * kBrickCells <= static_cast<double>(most)) || count * v.root_size() >= 1 << 21)
      return too_many();
    v.roots[k] = static_cast<uint32_t>(std::max(1.0, count));
    if (centred) v.low[k] -= 0.5 * (v.roots[k] * v.root_size() * v.spacing - (box.high[k] - box.low[k]));
  }
  for (uint32_t z = 0; z < v.roots.z; ++z)
    for (uint32_t y = 0; y < v.roots.y; ++y)
      for (uint32_t x = 0; x < v.roots.x; ++x) {
        ProbeBrick b;
        b.level = v.levels - 1;
        b.corner = UVec3(x, y, z) * v.root_size();
        b.parent = static_cast<uint32_t>(v.bricks.size());
        v.bricks.push_back(b);
      }
  if (!Layout(v, box, triangles, most).run() || !number_points(out, first_probe, most)) return too_many();
  return out;
}

}  // namespace kiln
