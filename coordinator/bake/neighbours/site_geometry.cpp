#include "coordinator/bake/neighbours/site_geometry.h"

#include <bit>

#include "common/base/parallel.h"
#include "common/raster/site_points.h"

namespace kiln {
namespace {

constexpr size_t kRun = 4096;

// Mean of the points of a mask, in texels.
DVec2 mean_point(uint64_t mask) {
  if (mask == ~uint64_t{0}) return DVec2(0.5);
  DVec2 sum(0.0);
  const double count = std::popcount(mask);
  for (; mask; mask &= mask - 1) {
    const auto j = static_cast<size_t>(std::countr_zero(mask));
    sum += DVec2(kSitePoints.x[j], kSitePoints.y[j]);
  }
  return sum / count;
}

// Positions and normals are linear over a face: their mean over a pair's points is their value at the mean
// point.
struct FaceMean {
  DVec3 position;
  Vec3 normal;
  double texel_size;
  uint32_t placement;
};

FaceMean mean_on_face(const Scene& scene, const Atlas& atlas, const DVec2& texel, uint64_t mask,
                      uint32_t instance, uint32_t face) {
  const Instance& object = scene.instances[instance];
  const Mesh& mesh = scene.meshes[object.mesh];
  const MeshCharts& charts = atlas.of_instance(instance);
  FaceMean out;
  out.placement = atlas.instance_first_chart[instance] + charts.chart_of_face[face];
  const Triangle2 flat = texel_triangle(charts, atlas.placements[out.placement], face);
  const double whole = area2(flat);
  const DVec2 p = texel + mean_point(mask);
  DVec2 b(1.0 / 3);
  if (whole != 0)
    b = {std::clamp(area2(flat.c[2], flat.c[0], p) / whole, 0.0, 1.0),
         std::clamp(area2(flat.c[0], flat.c[1], p) / whole, 0.0, 1.0)};
  if (!charts.parts.empty()) {
    const FacePart& part = charts.parts[face];
    b = DVec2(part.corner[0]) * (1 - b.x - b.y) + DVec2(part.corner[1]) * b.x + DVec2(part.corner[2]) * b.y;
  }
  const UVec3& v = mesh.triangles[charts.triangle_of(face)];
  const auto b1 = static_cast<float>(b.x), b2 = static_cast<float>(b.y), b0 = 1 - b1 - b2;
  const Mat4x3& m = object.to_world;
  const Vec3 local = mesh.positions[v.x] * b0 + mesh.positions[v.y] * b1 + mesh.positions[v.z] * b2;
  out.position = DVec3(transform_point(m, local));
  out.normal = normalize_or(
      transform_normal(m, mesh.normals[v.x] * b0 + mesh.normals[v.y] * b1 + mesh.normals[v.z] * b2),
      Vec3(0.0f));
  Vec3 corner[3];
  face_corners(mesh, charts, face, corner);
  const DVec3 across = cross(DVec3(transform_vector(m, corner[1] - corner[0])),
                             DVec3(transform_vector(m, corner[2] - corner[0])));
  out.texel_size = whole != 0 ? std::sqrt(length(across) / std::abs(whole)) : 0.0;
  return out;
}

void find_site(const Scene& scene, const Atlas& atlas, size_t site, SiteGeometry& out) {
  const uint32_t index = atlas.sites.texel[site] % (atlas.width * atlas.height);
  const DVec2 texel(index % atlas.width, index / atlas.width);
  const uint32_t* end = atlas.sites.words.data() + atlas.sites.first_word[site + 1];
  DVec3 position(0.0), normal(0.0);
  out.texel[site] = {index % atlas.width, index / atlas.width};
  int points = 0, most = 0;
  for (const uint32_t* pair = atlas.sites.words.data() + atlas.sites.first_word[site] + 2; pair < end;
       pair += 4) {
    const uint64_t mask = pair[0] | uint64_t{pair[1]} << 32;
    const int count = std::popcount(mask);
    const FaceMean face = mean_on_face(scene, atlas, texel, mask, pair[2], pair[3]);
    position += face.position * double(count);
    normal += DVec3(face.normal) * double(count);
    points += count;
    if (count > most) {
      most = count;
      out.texel_size[site] = static_cast<float>(face.texel_size);
      out.placement[site] = face.placement;
    }
  }
  out.position[site] = Vec3(position / double(std::max(points, 1)));
  out.normal[site] = normalize_or(Vec3(normal), Vec3(0.0f));
}

}  // namespace

SiteGeometry site_geometry(const Scene& scene, const Atlas& atlas, unsigned threads) {
  const size_t n = atlas.sites.size();
  SiteGeometry out;
  out.position.resize(n);
  out.normal.resize(n);
  out.texel_size.resize(n);
  out.placement.resize(n);
  out.texel.resize(n);
  parallel_for((n + kRun - 1) / kRun,
               [&](size_t run) {
                 for (size_t i = run * kRun; i < std::min(n, (run + 1) * kRun); ++i)
                   find_site(scene, atlas, i, out);
               },
               threads);
  return out;
}

SitePoint PointsOnSite::at(uint32_t index) {
  const SitePick at = picker_.at(index);
  if (!entered_ || at.instance != instance_ || at.triangle != triangle_) enter(at.instance, at.triangle);
  return {DVec3(corner_[0] + (corner_[1] - corner_[0]) * at.b1 + (corner_[2] - corner_[0]) * at.b2), normal_};
}

void PointsOnSite::enter(uint32_t instance, uint32_t triangle) {
  const Mat4x3& to_world = scene_.instances[instance].to_world;
  const Mesh& mesh = scene_.meshes[scene_.instances[instance].mesh];
  const UVec3& v = mesh.triangles[triangle];
  for (int k = 0; k < 3; ++k) corner_[k] = transform_point(to_world, mesh.positions[v[k]]);
  const Vec3 normal = normalize_or(cross(corner_[1] - corner_[0], corner_[2] - corner_[0]), Vec3(0.0f));
  normal_ = DVec3(determinant(to_world) < 0 ? -normal : normal);
  instance_ = instance;
  triangle_ = triangle;
  entered_ = true;
}

}  // namespace kiln
