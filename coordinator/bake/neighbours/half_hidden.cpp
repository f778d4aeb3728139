#include "coordinator/bake/neighbours/half_hidden.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "common/base/clock.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/raster/triangle2.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {
namespace {

constexpr int kPoints = 4;  // spread over the texel: the valid points are a low-discrepancy set
// KnownIrradiance::kNearestTexels: from there paths read the mean. (Workers' code; not included here.)
constexpr float kReach = 2;
// A texel counts as half hidden where the relative standard deviation of its points' openness is above this:
// what paths read is off by up to that times the relative deviation of the light. Where a wall meets a floor
// it is lower, so rooms keep their corners. docs/error_vs_time.md has the bias that is left and the rays it
// costs.
constexpr float kUneven = 0.4f;
constexpr float kOver = 0.1f;     // texels above the surface, where a wall is looked for
constexpr float kLift = 1e-3f;    // texels off the surface
constexpr size_t kTogether = 16;  // texels that are asked at once whether anything is near
constexpr float kMargin = 0.25f;  // texels, for the rounding of points onto their face

// Directions in x and y: as many for equal shares of even light (sunflower). z follows.
constexpr float kDirections[][2] = {{0.239f, 0.074f},  {-0.391f, 0.185f},  {0.211f, -0.518f},
                                    {0.229f, 0.620f},  {-0.667f, -0.343f}, {0.800f, -0.218f},
                                    {-0.481f, 0.762f}, {-0.172f, -0.953f}};

// A point off the surface, by no less than positions are rounded.
Vec3 lifted(const SitePoint& point, float size) {
  const Vec3 at(point.position);
  const float place = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
  return at + Vec3(point.normal) * std::max(kLift * size, 4 * 0x1p-23f * place);
}

// A plane that no ray from a texel's points goes below. The points may have several normals: then none, which
// a normal of 0 says.
struct Floor {
  DVec3 normal{0.0};
  double offset = 0;
};
Floor floor_of(std::span<const SitePoint> points, float size) {
  const DVec3& normal = points.front().normal;
  double offset = std::numeric_limits<double>::infinity();
  for (const SitePoint& p : points) {
    if (p.normal != normal) return {};
    offset = std::min(offset, dot(normal, DVec3(lifted(p, size))));
  }
  return {normal, offset};
}

// Whether something parts a texel's points, or covers some of them and not others: they are tied together by
// lines from each to the next, a little above the surface, and down to the points. The points are spread
// evenly and each is far from the next, so that whatever stands across the texel meets a line.
bool is_parted(const SceneRays& rays, std::span<const SitePoint> points, const Floor& floor, float size) {
  const auto above = [&](const SitePoint& p) { return Vec3(p.position + p.normal * double{kOver * size}); };
  BoxNode box;
  for (const SitePoint& p : points) {
    box.add(lifted(p, size));
    box.add(above(p));
  }
  const SceneRays::NearTriangles near = rays.near_triangles(box, floor.normal, floor.offset);
  if (near.empty()) return false;
  size_t covered = 0;
  Vec3 last = above(points[0]);
  for (size_t i = 0; i < points.size(); ++i) {
    const Vec3 point = lifted(points[i], size), here = above(points[i]);
    covered += near.is_blocked(point, here - point, 1.0f);
    if (covered > 0 && covered <= i) return true;
    if (here != last && near.is_blocked(last, here - last, 1.0f)) return true;
    last = here;
  }
  return false;
}

// Whether some of a texel's points are much more open than others.
bool is_uneven(const SceneRays& rays, std::span<const SitePoint> points, const Floor& floor, float size) {
  struct {
    Vec3 from, directions[std::size(kDirections)];
  } compared[kPoints];
  BoxNode box;
  for (size_t i = 0; i < kPoints; ++i) {
    // From the first to the last: these climb in both coordinates (points of a Hammersley set, site_point).
    const SitePoint& point = points[i * (points.size() - 1) / (kPoints - 1)];
    const Frame frame{Vec3(point.normal)};
    compared[i].from = lifted(point, size);
    box.add(compared[i].from);
    for (size_t d = 0; d < std::size(kDirections); ++d) {
      const auto& [x, y] = kDirections[d];
      compared[i].directions[d] = frame.to_world({x, y, std::sqrt(1 - x * x - y * y)});
      box.add(compared[i].from + kReach * size * compared[i].directions[d]);
    }
  }
  const SceneRays::NearTriangles near = rays.near_triangles(box, floor.normal, floor.offset);
  if (near.empty()) return false;
  int sum = 0, squares = 0;
  for (const auto& [from, directions] : compared) {
    int open = 0;
    for (const Vec3& direction : directions) open += !near.is_blocked(from, direction, kReach * size);
    sum += open;
    squares += open * open;
  }
  // The variance against the square of the mean, both times the square of the number of points.
  const auto square_of_mean = static_cast<float>(sum * sum);
  return static_cast<float>(kPoints * squares) - square_of_mean > kUneven * kUneven * square_of_mean;
}

// The pair of a texel all of whose points lie on one face; null for others.
const uint32_t* only_pair(const Atlas& atlas, size_t site) {
  const auto first = atlas.sites.first_word[site];
  return atlas.sites.first_word[site + 1] - first == 6 ? atlas.sites.words.data() + first + 2 : nullptr;
}

// Where places of the atlas lie in the world, on a face and in its plane beyond it.
class FacePlane {
 public:
  FacePlane(const Scene& scene, const Atlas& atlas, uint32_t instance, uint32_t face) {
    const MeshCharts& charts = atlas.of_instance(instance);
    flat_ = texel_triangle(
        charts, atlas.placements[atlas.instance_first_chart[instance] + charts.chart_of_face[face]], face);
    whole_ = area2(flat_);
    const Instance& object = scene.instances[instance];
    Vec3 own[3];
    face_corners(scene.meshes[object.mesh], charts, face, own);
    for (int k = 0; k < 3; ++k) corner_[k] = DVec3(transform_point(object.to_world, own[k]));
    const DVec3 across = cross(corner_[1] - corner_[0], corner_[2] - corner_[0]);
    const double area = length(across);
    if (area > 0) normal_ = across / (determinant(object.to_world) < 0 ? -area : area);
  }
  bool has_area() const { return whole_ != 0 && normal_ != DVec3(0.0); }
  const DVec3& normal() const { return normal_; }
  DVec3 at(const DVec2& texel) const {
    const double b1 = area2(flat_.c[2], flat_.c[0], texel) / whole_,
                 b2 = area2(flat_.c[0], flat_.c[1], texel) / whole_;
    return corner_[0] + b1 * (corner_[1] - corner_[0]) + b2 * (corner_[2] - corner_[0]);
  }

 private:
  Triangle2 flat_;
  double whole_ = 0;
  DVec3 corner_[3], normal_{0.0};
};

// Whether nothing is as near to any of these texels, all on the face of `pair`, as their rays reach. That is
// so of most texels of open ground, which then need no rays.
bool is_clear(const SceneRays& rays, const Scene& scene, const Atlas& atlas, const uint32_t* pair,
              size_t begin, size_t end, float size) {
  const FacePlane plane(scene, atlas, pair[2], pair[3]);
  if (!plane.has_area() || !(size > 0)) return false;
  DVec2 low(std::numeric_limits<double>::infinity()), high = -low;
  for (size_t site = begin; site < end; ++site) {
    const uint32_t texel = atlas.sites.texel[site] % (atlas.width * atlas.height);
    const DVec2 at(texel % atlas.width, texel / atlas.width);
    low = glm::min(low, at);
    high = glm::max(high, at + 1.0);
  }
  BoxNode box;
  double offset = std::numeric_limits<double>::infinity();
  const Vec3 reach((kReach + kMargin) * size);
  for (int k = 0; k < 4; ++k) {
    const DVec3 corner = plane.at({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y});
    offset = std::min(offset, dot(plane.normal(), corner));
    box.add(Vec3(corner) - reach);
    box.add(Vec3(corner) + reach);
  }
  // Half as far above the plane as rays begin: the face itself is below, and rays are above.
  return rays.near_triangles(box, plane.normal(), offset + 0.5 * double{kLift * size}).empty();
}

bool is_half_hidden(const SceneRays& rays, const Scene& scene, const Atlas& atlas, uint32_t site,
                    float size) {
  PointsOnSite on_site(scene, atlas, site);
  const uint32_t count = on_site.count();
  if (count < 2 || !(size > 0)) return false;
  SitePoint of_site[64];
  for (uint32_t i = 0; i < count; ++i) {
    of_site[i] = on_site.at(i);
    if (of_site[i].normal == DVec3(0.0)) return false;
  }
  const std::span<const SitePoint> points(of_site, count);
  const Floor floor = floor_of(points, size);
  return is_parted(rays, points, floor, size) || is_uneven(rays, points, floor, size);
}

}  // namespace

std::optional<std::vector<uint8_t>> half_hidden_sites(const Scene& scene, const Atlas& atlas,
                                                      const SiteGeometry& sites, unsigned threads,
                                                      double most_seconds) {
  const Stopwatch watch;
  const SceneRays rays(scene, threads);
  const size_t n = atlas.sites.size(), runs = (n + kParallelRun - 1) / kParallelRun;
  std::vector<uint8_t> out(n);
  const auto share_a_face = [&](size_t a, size_t b) {
    const uint32_t *one = only_pair(atlas, a), *other = only_pair(atlas, b);
    return one && other && one[2] == other[2] && one[3] == other[3];
  };
  const auto look = [&](size_t run) {
    const size_t end = std::min(n, (run + 1) * kParallelRun);
    for (size_t i = run * kParallelRun, next; i < end; i = next) {
      next = i + 1;
      while (next < std::min(end, i + kTogether) && share_a_face(i, next)) ++next;
      const float size = sites.texel_size[i];
      if (next - i > 1 && is_clear(rays, scene, atlas, only_pair(atlas, i), i, next, size)) continue;
      for (; i < next; ++i)
        out[i] = is_half_hidden(rays, scene, atlas, static_cast<uint32_t>(i), sites.texel_size[i]);
    }
  };
  if (!parallel_for_within(most_seconds - watch.seconds(), runs, look, threads)) return std::nullopt;
  return out;
}

}  // namespace kiln
