#include "worker/surface/coincident.h"

#include <algorithm>
#include <bit>
#include <tuple>

#include "common/scene/coincident.h"

namespace kiln {
namespace {

struct TriangleId {
  uint32_t instance, triangle;
  auto operator<=>(const TriangleId&) const = default;
};

// A coincident triangle, and the first triangle facing each side.
struct Shared {
  TriangleId id, first, other_side;  // other_side is `first` if nothing faces that way
};

// From the file's positions: surfaces store differences of corners, which round differently if the same
// triangle starts at another corner.
void corners_of(const Surfaces& surfaces, TriangleId id, Vec3 (&p)[3]) {
  const Instance& instance = surfaces.scene().instances[id.instance];
  const Mesh& mesh = surfaces.scene().meshes[instance.mesh];
  for (int k = 0; k < 3; ++k)
    p[k] = transform_point(instance.to_world, mesh.positions[mesh.triangles[id.triangle][k]]);
}

template <class Visit>
void for_each_opaque(const Surfaces& surfaces, const Visit& visit) {
  const Scene& scene = surfaces.scene();
  Vec3 p[3];
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (surfaces.has_alpha(i) || !scene.instances[i].cast) continue;
    const auto count = static_cast<uint32_t>(scene.meshes[scene.instances[i].mesh].triangles.size());
    for (uint32_t t = 0; t < count; ++t) {
      corners_of(surfaces, {i, t}, p);
      visit(TriangleId{i, t}, corner_hash(p));
    }
  }
}

struct Candidate {
  uint64_t hash;
  TriangleId id;
  auto operator<=>(const Candidate&) const = default;
};

// Triangles that share a hash cell with another: few unless triangles coincide, so only these are sorted.
// Ordered by hash and id.
std::vector<Candidate> find_candidates(const Surfaces& surfaces) {
  const size_t cells = std::bit_ceil(8 * std::max<size_t>(64, surfaces.scene().triangle_count()));
  std::vector<bool> once(cells), twice(cells);
  for_each_opaque(surfaces, [&](TriangleId, uint64_t hash) {
    const size_t cell = hash & (cells - 1);
    if (once[cell]) twice[cell] = true;
    once[cell] = true;
  });
  std::vector<Candidate> found;
  for_each_opaque(surfaces, [&](TriangleId id, uint64_t hash) {
    if (twice[hash & (cells - 1)]) found.push_back({hash, id});
  });
  std::sort(found.begin(), found.end());
  return found;
}

Vec3 normal_of(const Surfaces& surfaces, TriangleId id) {
  return surfaces.at(id.instance, id.triangle, 0.0f, 0.0f).ng;
}

std::vector<Shared> find_shared(const Surfaces& surfaces) {
  const std::vector<Candidate> candidates = find_candidates(surfaces);
  std::vector<Shared> shared;
  for (size_t begin = 0, end = 0; begin < candidates.size(); begin = end) {
    while (end < candidates.size() && candidates[end].hash == candidates[begin].hash) ++end;
    const TriangleId first = candidates[begin].id;
    Vec3 a[3], b[3];
    corners_of(surfaces, first, a);
    const size_t group = shared.size();
    TriangleId other_side = first;
    for (size_t i = begin; i < end; ++i) {
      const TriangleId id = candidates[i].id;
      corners_of(surfaces, id, b);
      if (same_corners(a, b) == 0) continue;  // a 64-bit hash collision
      if (other_side == first && dot(normal_of(surfaces, first), normal_of(surfaces, id)) < 0.0f)
        other_side = id;
      shared.push_back({id, first, first});
    }
    if (shared.size() == group + 1) shared.pop_back();
    for (size_t i = group; i < shared.size(); ++i) shared[i].other_side = other_side;
  }
  std::sort(shared.begin(), shared.end(), [](const Shared& x, const Shared& y) { return x.id < y.id; });
  return shared;
}

class CoincidentRule final : public Tracer {
 public:
  CoincidentRule(std::unique_ptr<Tracer> inner, const Surfaces& surfaces, std::vector<Shared> shared)
      : inner_(std::move(inner)), surfaces_(surfaces), shared_(std::move(shared)) {
    concerned_.resize(surfaces.scene().instances.size());
    for (const Shared& s : shared_) concerned_[s.id.instance] = true;
  }

  Hit intersect(const Ray& ray, uint32_t key) const override {
    const Hit hit = inner_->intersect(ray, key);
    if (!hit.valid() || !concerned_[hit.instance]) return hit;
    const TriangleId id{hit.instance, hit.triangle};
    const auto at = std::lower_bound(shared_.begin(), shared_.end(), id,
                                     [](const Shared& s, TriangleId wanted) { return s.id < wanted; });
    if (at == shared_.end() || at->id != id) return hit;
    const bool faces = dot(ray.direction, normal_of(surfaces_, at->first)) < 0.0f;
    return meet(ray, faces ? at->first : at->other_side, hit);
  }
  Vec3 transmittance(const Ray& ray) const override { return inner_->transmittance(ray); }
  void transmittance(std::span<const Ray> rays, Vec3* passed) const override {
    inner_->transmittance(rays, passed);
  }
  size_t memory_bytes() const override { return inner_->memory_bytes() + shared_.size() * sizeof(Shared); }

 private:
  // Intersects the ray with triangle `id`, in double; returns `hit` if they are parallel.
  Hit meet(const Ray& ray, TriangleId id, const Hit& hit) const {
    Vec3 p[3];
    corners_of(surfaces_, id, p);
    const DVec3 origin = DVec3(p[0]), e1 = DVec3(p[1]) - origin, e2 = DVec3(p[2]) - origin;
    const DVec3 d(ray.direction), from = DVec3(ray.origin) - origin;
    const DVec3 n = cross(e1, e2);
    const double slope = dot(d, n);
    if (slope == 0) return hit;
    const double t = -dot(from, n) / slope;
    const DVec3 q = from + d * t;
    double b1 = std::clamp(dot(cross(q, e2), n) / dot(n, n), 0.0, 1.0);
    const double b2 = std::clamp(dot(cross(e1, q), n) / dot(n, n), 0.0, 1.0);
    b1 = std::min(b1, 1 - b2);
    return {id.instance, id.triangle, static_cast<float>(b1), static_cast<float>(b2),
            static_cast<float>(std::max(t, 0.0))};
  }

  std::unique_ptr<Tracer> inner_;
  const Surfaces& surfaces_;
  std::vector<Shared> shared_;   // by id
  std::vector<bool> concerned_;  // by instance
};

}  // namespace

std::unique_ptr<Tracer> with_coincident_rule(std::unique_ptr<Tracer> tracer, const Surfaces& surfaces) {
  std::vector<Shared> shared = find_shared(surfaces);
  if (shared.empty()) return tracer;
  return std::make_unique<CoincidentRule>(std::move(tracer), surfaces, std::move(shared));
}

}  // namespace kiln
