#include "coordinator/report/view_score.h"

#include <algorithm>
#include <cmath>

#include "coordinator/output/look/tone.h"

namespace kiln {
namespace {

// Entropy in bits of the frequencies of keys: 0 if there is only one key.
template <class Key>
double entropy(std::vector<Key> keys) {
  std::sort(keys.begin(), keys.end());
  double bits = 0;
  const auto all = static_cast<double>(keys.size());
  for (size_t i = 0; i < keys.size();) {
    size_t end = i;
    while (end < keys.size() && keys[end] == keys[i]) ++end;
    const double share = static_cast<double>(end - i) / all;
    bits -= share * std::log2(share);
    i = end;
  }
  return bits;
}

double deviation(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  const auto n = static_cast<double>(values.size());
  return n > 0 ? std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n))) : 0.0;
}

float quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// 1 up to `low`, 0 from `high`, linear in between.
double falling(double x, double low, double high) {
  return std::clamp((high - x) / (high - low), 0.0, 1.0);
}

// Spread of E as displayed on a screen.
double contrast(const std::vector<float>& light) {
  const float exposure = exposure_of(light);
  std::vector<double> shown;
  for (const float l : light) shown.push_back(std::sqrt(double{filmic(l * exposure)}));
  return deviation(shown);
}

}  // namespace

bool Watcher::solid(const RayHit& hit) const {
  return look_.solid({1.0f, hit.instance, hit.triangle, hit.b1, hit.b2, hit.back});
}

float Watcher::free_way(const Vec3& origin, const Vec3& direction, float far) const {
  RayHit hit;
  return rays_.closest(origin, direction, far, hit, [&](const RayHit& h) { return solid(h); }) ? hit.distance
                                                                                               : far;
}

Sight Watcher::along(const Vec3& origin, const Vec3& direction) const {
  RayHit hit;
  Sight s;
  if (!rays_.closest(origin, direction, 1e30f, hit, [&](const RayHit& h) { return solid(h); })) return s;
  const Instance& instance = scene_.instances[hit.instance];
  const Mesh& mesh = scene_.meshes[instance.mesh];
  const UVec3& t = mesh.triangles[hit.triangle];
  Vec3 c[3];
  for (int k = 0; k < 3; ++k) c[k] = transform_point(instance.to_world, mesh.positions[t[k]]);
  const Vec3 normal = normalize_or(cross(c[1] - c[0], c[2] - c[0]), Vec3(0, 1, 0));
  // A thin wall that is drawn double-sided has no back.
  s.kind = hit.back && !look_.double_sided(hit.instance) ? Sight::Kind::kBack : Sight::Kind::kFront;
  s.distance = hit.distance;
  s.object = hit.instance;
  const auto step = [](float v) {
    return static_cast<uint64_t>(static_cast<int64_t>(std::lround(v)) & 0x7ff);
  };
  s.plane = step(3 * normal.x) << 33 | step(3 * normal.y) << 22 | step(3 * normal.z) << 11 |
            step(dot(normal, c[0]) / (0.03f * size_));
  Vec3 e;
  const Fragment f{1 / hit.distance, hit.instance, hit.triangle, hit.b1, hit.b2, hit.back};
  s.light = look_.irradiance(f, e) ? luminance(e) : -1;
  return s;
}

std::vector<Sight> Watcher::view(const Camera& camera, uint32_t width, uint32_t height) const {
  const float tall = std::tan(0.5f * camera.vertical_fov), wide = tall * 16 / 9;
  std::vector<Sight> sights;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const Vec3 local(wide * (2 * (static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 1),
                       tall * (1 - 2 * (static_cast<float>(y) + 0.5f) / static_cast<float>(height)), -1);
      sights.push_back(
          along(camera.to_world[3], normalize_or(transform_vector(camera.to_world, local), Vec3(0, 0, -1))));
    }
  return sights;
}

double view_score(const std::vector<Sight>& sights, float usual, double size) {
  std::vector<uint32_t> objects;
  std::vector<uint64_t> planes;
  std::vector<double> depths;
  std::vector<float> distances, light;
  size_t back = 0, lit = 0;
  for (const Sight& s : sights) {
    back += s.kind == Sight::Kind::kBack;
    if (s.kind != Sight::Kind::kFront) continue;
    objects.push_back(s.object);
    planes.push_back(s.plane);
    depths.push_back(std::log2(std::max(1e-6, double{s.distance})));
    distances.push_back(s.distance);
    lit += s.light > 0.05f * usual;
    if (s.light > 0) light.push_back(s.light);
  }
  const auto all = static_cast<double>(sights.size());
  const double front = static_cast<double>(objects.size()) / all;
  if (objects.empty()) return 0;
  const float far = quantile(distances, 0.75);
  const auto near = static_cast<double>(
      std::count_if(distances.begin(), distances.end(), [&](float d) { return d < 0.25f * far; }));
  const double variety =
      0.35 * std::min(1.0, entropy(objects) / 4) + 0.25 * std::min(1.0, entropy(planes) / 5) +
      0.10 * std::min(1.0, deviation(depths) / 1.2) + 0.15 * std::min(1.0, contrast(light) / 0.2) +
      0.15 * std::min(1.0, double{far} / (0.4 * size));
  const double bright = static_cast<double>(lit) / static_cast<double>(objects.size());
  return (0.05 + 0.95 * variety) * std::min(1.0, front / 0.8) * falling(back / all, 0.01, 0.2) *
         falling(near / all, 0.04, 0.4) * (0.05 + 0.95 * std::min(1.0, bright / 0.6));
}

bool shows_something(const std::vector<Sight>& sights) {
  std::vector<uint64_t> planes;
  size_t back = 0;
  for (const Sight& s : sights) {
    back += s.kind == Sight::Kind::kBack;
    if (s.kind == Sight::Kind::kFront) planes.push_back(s.plane);
  }
  return planes.size() * 20 >= sights.size() && back * 2 < sights.size() && entropy(planes) > 0.3;
}

}  // namespace kiln
