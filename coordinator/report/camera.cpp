// Two stages. First, points spread over the scene look around with a few rays; the best of them
// render a panorama, and every direction of it is scored as a view. Then the best views, some steps
// back from each, and views from outside are scored as pictures.
#include "coordinator/report/camera.h"

#include <algorithm>

#include "common/base/parallel.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/view_score.h"

namespace kiln {
namespace {

constexpr float kFov = 1.0f;  // vertical, radians; 1.54 rad across at 16:9
constexpr float kTurn = 6.28318530718f;
constexpr size_t kPlaces = 192, kPanoramas = 40, kFine = 14;
constexpr uint32_t kAround = 48, kUp = 14;  // directions in a panorama
constexpr float kLowest = -0.95f, kHighest = 0.65f;

struct Bounds {
  Vec3 low{0.0f}, high{0.0f};
};

struct Candidate {
  Camera camera;
  double score = 0;
};

// Bounds of all vertices, and of those within the middle 98 % of each axis: details attract
// vertices, but a plain room around one fine statue has few.
struct Extent {
  Bounds whole, busy;
};

Extent extent_of(const Scene& scene) {
  constexpr size_t kMaxPoints = 30000;
  size_t vertices = 0, at = 0;
  for (const Instance& i : scene.instances) vertices += scene.meshes[i.mesh].positions.size();
  const size_t step = std::max<size_t>(1, vertices / kMaxPoints);
  std::vector<float> axis[3];
  for (const Instance& i : scene.instances) {
    const auto& positions = scene.meshes[i.mesh].positions;
    for (; at < positions.size(); at += step) {
      const Vec3 p = transform_point(i.to_world, positions[at]);
      for (int k = 0; k < 3; ++k) axis[k].push_back(p[k]);
    }
    at -= positions.size();
  }
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    std::sort(axis[k].begin(), axis[k].end());
    const size_t hundredth = axis[k].size() / 100;
    extent.whole.low[k] = axis[k].front();
    extent.whole.high[k] = axis[k].back();
    extent.busy.low[k] = axis[k][hundredth];
    extent.busy.high[k] = axis[k][axis[k].size() - 1 - hundredth];
  }
  return extent;
}

// The whole scene, but no further from the busy part than its width: do not stand far out on a ground plane.
Bounds near_busy(const Extent& e) {
  const Vec3 centre = 0.5f * (e.busy.low + e.busy.high), half = 0.5f * (e.busy.high - e.busy.low);
  const Vec3 reach = glm::max(2.0f * half, Vec3(0.5f * max_component(half)));
  return {glm::max(e.whole.low, centre - reach), glm::min(e.whole.high, centre + reach)};
}

// Halton sequence.
float radical_inverse(uint32_t index, uint32_t base) {
  float result = 0, digit = 1.0f / static_cast<float>(base);
  for (; index; index /= base, digit /= static_cast<float>(base))
    result += static_cast<float>(index % base) * digit;
  return result;
}

Vec3 sphere_direction(size_t i, size_t count) {
  const float y = 1 - (2 * static_cast<float>(i) + 1) / static_cast<float>(count);
  const float r = std::sqrt(std::max(0.0f, 1 - y * y)), a = 2.39996323f * static_cast<float>(i);
  return {r * std::cos(a), y, r * std::sin(a)};
}

Vec3 panorama_direction(uint32_t around, uint32_t up) {
  const float a = kTurn * (static_cast<float>(around) + 0.5f) / kAround;
  const float e = kLowest + (kHighest - kLowest) * (static_cast<float>(up) + 0.5f) / kUp;
  return {std::cos(e) * std::cos(a), std::sin(e), std::cos(e) * std::sin(a)};
}

class Chooser {
 public:
  Chooser(const ImportResult& imported, const Atlas& atlas, const Lightmap& map)
      : extent_(extent_of(imported.scene)),
        size_(std::max(1e-3f, length(extent_.busy.high - extent_.busy.low))),
        usual_(usual_light(map)),
        look_(imported.scene, atlas, map),
        rays_(imported.scene),
        watcher_(imported.scene, look_, rays_, size_) {}

  Camera choose() const {
    std::vector<Candidate> candidates = from_outside();
    for (Candidate& c : best_views(best_places())) candidates.push_back(std::move(c));
    parallel_for(candidates.size(), [&](size_t i) {
      candidates[i].score = view_score(watcher_.view(candidates[i].camera, 48, 27), usual_, size_);
    });
    return std::max_element(candidates.begin(), candidates.end(),
                            [](const Candidate& a, const Candidate& b) { return a.score < b.score; })
        ->camera;
  }

 private:
  struct Place {
    Vec3 eye;
    double score;
  };

  static float usual_light(const Lightmap& map) {
    std::vector<float> light;
    const size_t step = std::max<size_t>(1, map.validity.size() / 65536);
    for (size_t t = 0; t < map.validity.size(); t += step)
      if (map.validity[t] == Validity::kMeasured)
        light.push_back(luminance(Vec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t])));
    std::erase_if(light, [](float l) { return !(l > 0); });
    if (light.empty()) return 0;
    const auto middle = light.begin() + static_cast<ptrdiff_t>(light.size() / 2);
    std::nth_element(light.begin(), middle, light.end());
    return *middle;
  }

  // Free distance up and down from a point; size_ if there is no surface.
  struct Room {
    float down, up;
    float height(float size) const { return up >= size ? 2 * size : down + up; }
  };
  Room room_at(const Vec3& p) const {
    return {watcher_.free_way(p, Vec3(0, -1, 0), size_), watcher_.free_way(p, Vec3(0, 1, 0), size_)};
  }

  // Half-way up between floor and ceiling, otherwise a little above the floor. Places lower than
  // `least` (under a table or chair) are left for the space above.
  Vec3 at_eye_level(Vec3 p, float least) const {
    Room room = room_at(p);
    for (int k = 0; k < 3 && room.height(size_) < least; ++k) {
      p.y += room.up + 1e-3f * size_;
      room = room_at(p);
    }
    if (room.down >= size_) return p;
    const float height =
        room.up >= size_ ? std::min(room.down, 0.15f * size_) : 0.55f * (room.down + room.up);
    return p + Vec3(0, height - room.down, 0);
  }

  std::vector<Vec3> points() const {
    const Bounds wide = near_busy(extent_);
    std::vector<Vec3> out;
    for (uint32_t n = 1; n <= kPlaces; ++n) {
      const Bounds& box = n % 2 ? extent_.busy : wide;
      const Vec3 share(radical_inverse(n, 2), radical_inverse(n, 3), radical_inverse(n, 5));
      out.push_back(box.low + share * (box.high - box.low));
    }
    return out;
  }

  // A share of the usual room height, ignoring tables.
  float least_height(const std::vector<Vec3>& at) const {
    std::vector<float> heights(at.size());
    parallel_for(at.size(), [&](size_t i) { heights[i] = room_at(at[i]).height(size_); });
    std::erase_if(heights, [&](float h) { return h >= size_; });
    if (heights.empty()) return 0;
    const auto tall = heights.begin() + static_cast<ptrdiff_t>(heights.size() * 3 / 4);
    std::nth_element(heights.begin(), tall, heights.end());
    return 0.4f * *tall;
  }

  std::vector<Place> best_places() const {
    constexpr size_t kRays = 40;
    std::vector<Place> places(kPlaces);
    const std::vector<Vec3> at = points();
    const float least = least_height(at);
    parallel_for(kPlaces, [&](size_t i) {
      places[i].eye = at_eye_level(at[i], least);
      std::vector<Sight> sights;
      for (size_t k = 0; k < kRays; ++k)
        sights.push_back(watcher_.along(places[i].eye, sphere_direction(k, kRays)));
      places[i].score = view_score(sights, usual_, size_);
      for (const Sight& s : sights)  // too close to something
        if (s.kind != Sight::Kind::kNothing && s.distance < 0.01f * size_) places[i].score *= 0.8;
    });
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.score > b.score; });
    places.resize(std::min(places.size(), kPanoramas));
    return places;
  }

  // The best view of each place, then the best of those with steps back from them.
  std::vector<Candidate> best_views(const std::vector<Place>& places) const {
    std::vector<Candidate> views(places.size());
    parallel_for(places.size(), [&](size_t i) { views[i] = best_view(places[i].eye); });
    std::stable_sort(views.begin(), views.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    views.resize(std::min(views.size(), kFine));
    const size_t count = views.size();
    for (size_t i = 0; i < count; ++i) {
      const Vec3 eye = views[i].camera.to_world[3], forward = -views[i].camera.to_world[2];
      const float way = watcher_.free_way(eye, -forward, 0.5f * size_);
      for (const float share : {0.45f, 0.8f})
        views.push_back({look_along(eye - forward * (share * way), forward, kFov, "chosen"), 0});
    }
    return views;
  }

  Candidate best_view(const Vec3& eye) const {
    std::vector<Sight> sights;
    for (uint32_t up = 0; up < kUp; ++up)
      for (uint32_t around = 0; around < kAround; ++around)
        sights.push_back(watcher_.along(eye, panorama_direction(around, up)));
    // A window of 1.54 x 1 radians.
    constexpr uint32_t kWide = 12, kTall = 9;
    Candidate best;
    best.score = -1;
    std::vector<Sight> window;
    for (uint32_t low = 0; low + kTall <= kUp; low += 2)
      for (uint32_t left = 0; left < kAround; left += 3) {
        window.clear();
        for (uint32_t y = 0; y < kTall; ++y)
          for (uint32_t x = 0; x < kWide; ++x)
            window.push_back(sights[(low + y) * kAround + (left + x) % kAround]);
        const double score = view_score(window, usual_, size_);
        if (score <= best.score) continue;
        const float a = kTurn * (static_cast<float>(left) + 0.5f * kWide) / kAround;
        const float e = kLowest + (kHighest - kLowest) * (static_cast<float>(low) + 0.5f * kTall) / kUp;
        best = {look_along(eye, Vec3(std::cos(e) * std::cos(a), std::sin(e), std::cos(e) * std::sin(a)), kFov,
                           "chosen"),
                score};
      }
    return best;
  }

  std::vector<Candidate> from_outside() const {
    const Vec3 centre = 0.5f * (extent_.busy.low + extent_.busy.high);
    std::vector<Candidate> out;
    for (const float up : {0.2f, 0.55f})
      for (int turn = 0; turn < 8; ++turn) {
        const float a = kTurn * (static_cast<float>(turn) + (up > 0.3f ? 0.5f : 0.0f)) / 8;
        const Vec3 way(std::cos(a), up, std::sin(a));
        out.push_back({look_along(centre + way * (0.8f * size_), -way, kFov, "chosen"), 0});
      }
    return out;
  }

  Extent extent_;
  float size_, usual_;
  SurfaceLook look_;
  SceneRays rays_;
  Watcher watcher_;
};

}  // namespace

Camera look_along(const Vec3& eye, const Vec3& forward, float vertical_fov, std::string name) {
  Camera c;
  const Vec3 z = normalize_or(-forward, Vec3(0, 0, 1));
  const Vec3 x = normalize_or(cross(Vec3(0, 1, 0), z), Vec3(1, 0, 0));
  c.to_world = Mat4x3(x, cross(z, x), z, eye);
  c.vertical_fov = vertical_fov;
  c.name = std::move(name);
  return c;
}

Camera choose_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map) {
  return Chooser(imported, atlas, map).choose();
}

}  // namespace kiln
