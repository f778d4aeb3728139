#include "coordinator/neighbours/views.h"

#include <cmath>

#include "common/base/clock.h"
#include "common/base/parallel.h"
#include "coordinator/sight/scene_rays.h"

namespace kiln {
namespace {

constexpr size_t kDirections = 8;
constexpr float kLeastCosine = 0.2f;  // of a direction that is asked, to the normal
constexpr float kFar = 32;            // texels: beyond, all is alike
constexpr float kApart = 4;           // distances that differ by this factor are of other things
constexpr float kNear = 8;            // texels: where both are further, both are in the open
constexpr float kLift = 1e-3f;        // texels off the surface

// The corners of a cube, turned so that none is along an axis of a model.
std::array<Vec3, kDirections> directions() {
  // A rotation of whole-numbered quaternion (5, 2, 3, 1).
  const float w = 5, x = 2, y = 3, z = 1, n = std::sqrt(3.0f) * (w * w + x * x + y * y + z * z);
  std::array<Vec3, kDirections> out;
  for (size_t i = 0; i < kDirections; ++i) {
    const Vec3 v(i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f);
    out[i] =
        Vec3((w * w + x * x - y * y - z * z) * v.x + 2 * (x * y - w * z) * v.y + 2 * (x * z + w * y) * v.z,
             2 * (x * y + w * z) * v.x + (w * w - x * x + y * y - z * z) * v.y + 2 * (y * z - w * x) * v.z,
             2 * (x * z - w * y) * v.x + 2 * (y * z + w * x) * v.y + (w * w - x * x - y * y + z * z) * v.z) /
        n;
  }
  return out;
}

// Texels to the first surface by direction; 0: not asked. Below 0: from the inner side of it.
using View = std::array<float, kDirections>;

bool differ(const View& a, const View& b) {
  int asked = 0, other = 0;
  for (size_t k = 0; k < kDirections; ++k) {
    if (a[k] == 0 || b[k] == 0) continue;
    ++asked;
    const float near = std::min(std::abs(a[k]), std::abs(b[k])), far = std::max(std::abs(a[k]), std::abs(b[k]));
    other += (near < kNear && near * kApart < far) || (a[k] < 0) != (b[k] < 0);
  }
  return asked > 0 && 2 * other > asked;
}

}  // namespace

std::optional<size_t> part_by_view(const Scene& scene, const SiteGeometry& sites, unsigned threads,
                                   double most_seconds, SurfaceLinks& links) {
  const Stopwatch watch;
  const SceneRays rays(scene, threads);
  const std::array<Vec3, kDirections> ask = directions();
  const size_t n = sites.size(), runs = (n + kParallelRun - 1) / kParallelRun;
  std::vector<View> views(n);
  const auto look = [&](size_t run) {
    for (size_t i = run * kParallelRun; i < std::min(n, (run + 1) * kParallelRun); ++i) {
      const float size = sites.texel_size[i];
      if (!(size > 0)) continue;
      const Vec3 normal = sites.normal[i], from = sites.position[i] + normal * (kLift * size);
      for (size_t k = 0; k < kDirections; ++k) {
        if (dot(normal, ask[k]) < kLeastCosine) continue;
        RayHit hit;
        views[i][k] = rays.closest(from, ask[k], kFar * size, hit)
                          ? std::max(hit.distance / size, 1e-6f) * (hit.back ? -1.0f : 1.0f)
                          : kFar;
      }
    }
  };
  // One run in so many tells how long all of them take.
  constexpr size_t kAsked = 64;
  const double began = watch.seconds();
  parallel_for((runs + kAsked - 1) / kAsked, [&](size_t i) { look(i * kAsked); }, threads);
  if (began + (watch.seconds() - began) * kAsked > most_seconds) return std::nullopt;
  parallel_for(runs, [&](size_t run) { if (run % kAsked) look(run); }, threads);
  std::vector<uint8_t> keeps(links.link.size());
  for_each_index(n, threads, [&](size_t i) {
    for (uint32_t l = links.first[i]; l < links.first[i + 1]; ++l)
      keeps[l] = !differ(views[i], views[links.link[l]]);
  });
  uint32_t kept = 0;
  size_t taken = 0;
  for (size_t i = 0, begin = 0; i < n; ++i) {
    const uint32_t end = links.first[i + 1];
    for (size_t l = begin; l < end; ++l)
      if (keeps[l])
        links.link[kept++] = links.link[l];
      else
        ++taken;
    begin = end;
    links.first[i + 1] = kept;
  }
  links.link.resize(kept);
  return taken / 2;
}

}  // namespace kiln
