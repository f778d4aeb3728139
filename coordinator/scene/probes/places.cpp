#include "coordinator/scene/probes/places.h"

#include <algorithm>
#include <array>

#include "common/math/warp.h"

namespace kiln {
namespace {

constexpr size_t kRays = 128;
constexpr size_t kTries = 8;                               // ways out that are tried, nearest first
constexpr float kMargin = 0.1f;                            // spacings between a probe and the nearest surface
constexpr float kEpsilon = 1e-4f;                          // spacings
constexpr float kFar = std::numeric_limits<float>::max();  // infinite, every box would count as met

// A spherical Fibonacci lattice (Keinert et al. 2015).
const std::array<Vec3, kRays>& directions() {
  static const auto kDirections = [] {
    std::array<Vec3, kRays> out;
    for (size_t i = 0; i < kRays; ++i) {
      const double turns = static_cast<double>(i) * 0.6180339887498949;
      out[i] = spherical(1.0f - (2.0f * static_cast<float>(i) + 1.0f) / kRays,
                         static_cast<float>(turns - std::floor(turns)));
    }
    return out;
  }();
  return kDirections;
}

struct View {
  float backs = 0;  // share of directions
  float nearest_front = std::numeric_limits<float>::infinity();
  Vec3 towards_front{0.0f};
  std::vector<std::pair<float, Vec3>> ways_out;  // back faces: distance and direction, nearest first
};

class Places {
 public:
  Places(const SceneRays& rays, const Solid& solid, const Vec3& grid, float spacing)
      : rays_(rays), solid_(solid), grid_(grid), spacing_(spacing) {}

  ProbePlace find() const {
    const View here = look(grid_);
    ProbePlace out{grid_, ProbeState::kActive, 1 - here.backs, {}};
    if (here.backs > kMostBacks) return leave(here, out);
    if (here.nearest_front < kMargin * spacing_) return step_back(here, out);
    return out;
  }

 private:
  View look(const Vec3& from) const {
    View view;
    const auto stops = [&](const RayHit& hit) { return solid_.stops(hit); };
    for (const Vec3& d : directions()) {
      RayHit hit;
      if (!rays_.closest(from, d, kFar, hit, stops)) continue;
      if (solid_.shows(hit)) {
        if (hit.distance < view.nearest_front) view.nearest_front = hit.distance, view.towards_front = d;
      } else {
        view.ways_out.emplace_back(hit.distance, d);
      }
    }
    view.backs = static_cast<float>(view.ways_out.size()) / kRays;
    std::stable_sort(view.ways_out.begin(), view.ways_out.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    return view;
  }

  bool is_near(const Vec3& place) const {
    return max_component(glm::abs(place - grid_)) <= kMostMoved * spacing_;
  }

  ProbePlace leave(const View& here, ProbePlace out) const {
    for (size_t i = 0; i < std::min(kTries, here.ways_out.size()); ++i) {
      const auto& [distance, direction] = here.ways_out[i];
      const Vec3 surface = grid_ + direction * distance;
      const Vec3 place = surface + direction * free_way(surface, direction);
      const View there = look(place);
      if (there.backs > kMostBacks) continue;
      if (is_near(place)) return {place, ProbeState::kMoved, 1 - there.backs, {}};
      if (!out.exit) out.exit = place;
    }
    out.state = ProbeState::kInactive;
    return out;
  }

  // How far to go from a surface: the margin, or half way to the next one.
  float free_way(const Vec3& from, const Vec3& direction) const {
    RayHit next;
    const float margin = kMargin * spacing_;
    const bool blocked = rays_.closest(from + direction * (kEpsilon * spacing_), direction, 2 * margin, next,
                                       [&](const RayHit& hit) { return solid_.stops(hit); });
    return blocked ? std::max(kEpsilon * spacing_, 0.5f * next.distance) : margin;
  }

  ProbePlace step_back(const View& here, ProbePlace out) const {
    const Vec3 away = -here.towards_front;
    const float wanted = kMargin * spacing_ - here.nearest_front;
    const Vec3 place = grid_ + away * std::min(wanted, free_way(grid_, away));
    const View there = look(place);
    if (there.backs > kMostBacks || !(there.nearest_front > here.nearest_front)) return out;
    return {place, ProbeState::kMoved, 1 - there.backs, {}};
  }

  const SceneRays& rays_;
  const Solid& solid_;
  const Vec3 grid_;
  const float spacing_;
};

}  // namespace

ProbePlace place_probe(const SceneRays& rays, const Solid& solid, const Vec3& grid, float spacing) {
  return Places(rays, solid, grid, spacing).find();
}

}  // namespace kiln
