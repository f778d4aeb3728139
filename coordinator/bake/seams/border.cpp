#include "coordinator/bake/seams/border.h"

#include <array>
#include <bit>

#include "common/base/parallel.h"

namespace kiln {
namespace {

uint32_t key_bits(float f) {
  return std::bit_cast<uint32_t>(f == 0.0f ? 0.0f : f);  // -0 is 0
}

// Corners of faces (3 per face) with equal chart, position and coordinates share a number.
std::vector<uint32_t> weld_face_corners(const Mesh& mesh, const MeshCharts& charts) {
  struct Keyed {
    std::array<uint32_t, 6> key;
    uint32_t corner;
    auto operator<=>(const Keyed&) const = default;
  };
  std::vector<Keyed> sorted;
  sorted.reserve(3 * charts.face_count());
  for (uint32_t face = 0; face < charts.face_count(); ++face) {
    Vec3 p[3];
    face_corners(mesh, charts, face, p);
    for (uint32_t k = 0; k < 3; ++k) {
      const Vec2& uv = charts.corner_uv[3 * size_t{face} + k];
      sorted.push_back({{charts.chart_of_face[face], key_bits(p[k].x), key_bits(p[k].y), key_bits(p[k].z),
                         key_bits(uv.x), key_bits(uv.y)},
                        3 * face + k});
    }
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<uint32_t> number(sorted.size());
  uint32_t next = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].key != sorted[i - 1].key) ++next;
    number[sorted[i].corner] = next;
  }
  return number;
}

uint32_t next_corner(uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

// Sides, by their first corner, that are not shared by exactly two faces.
std::vector<uint32_t> border_sides(const Mesh& mesh, const MeshCharts& charts) {
  struct Side {
    uint32_t a, b, corner;
    auto operator<=>(const Side&) const = default;
  };
  const std::vector<uint32_t> weld = weld_face_corners(mesh, charts);
  std::vector<Side> sides;
  sides.reserve(weld.size());
  for (uint32_t corner = 0; corner < weld.size(); ++corner) {
    const uint32_t a = weld[corner], b = weld[next_corner(corner)];
    if (a != b) sides.push_back({std::min(a, b), std::max(a, b), corner});
  }
  std::sort(sides.begin(), sides.end());
  std::vector<uint32_t> border;
  for (size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b;) ++end;
    if (end - i == 2) continue;
    for (size_t k = i; k < end; ++k) border.push_back(sides[k].corner);
  }
  std::sort(border.begin(), border.end());
  return border;
}

DVec3 to_world(const Mat4x3& m, const Vec3& p) {
  return DVec3(m[0]) * double{p.x} + DVec3(m[1]) * double{p.y} + DVec3(m[2]) * double{p.z} + DVec3(m[3]);
}

Vec3 corner_normal(const Mesh& mesh, const MeshCharts& charts, uint32_t face, uint32_t k) {
  const UVec3& v = mesh.triangles[charts.triangle_of(face)];
  if (charts.parts.empty()) return mesh.normals[v[static_cast<int>(k)]];
  const Vec2 b = charts.parts[face].corner[k];
  return mesh.normals[v.x] * (1.0f - b.x - b.y) + mesh.normals[v.y] * b.x + mesh.normals[v.z] * b.y;
}

// False if the edge or its face has no extent.
bool make_edge(const Scene& scene, const Atlas& atlas, uint32_t instance, uint32_t corner, BorderEdge& edge) {
  const Instance& object = scene.instances[instance];
  const Mesh& mesh = scene.meshes[object.mesh];
  const MeshCharts& charts = atlas.of_instance(instance);
  const uint32_t face = corner / 3, k[3] = {corner % 3, (corner + 1) % 3, (corner + 2) % 3};
  edge.placement = atlas.instance_first_chart[instance] + charts.chart_of_face[face];
  const ChartPlacement& place = atlas.placements[edge.placement];
  edge.page = place.page;

  Vec3 local[3];
  face_corners(mesh, charts, face, local);
  const Triangle2 flat = texel_triangle(charts, place, face);
  for (int end = 0; end < 2; ++end) {
    edge.p[end] = to_world(object.to_world, local[k[end]]);
    edge.texel[end] = flat.c[k[end]];
    edge.normal[end] = normalize_or(
        transform_normal(object.to_world, corner_normal(mesh, charts, face, k[end])), Vec3(0.0f));
  }
  const DVec3 along = edge.p[1] - edge.p[0], across = to_world(object.to_world, local[k[2]]) - edge.p[0];
  const double square = dot(along, along);
  if (!(square > 0) || !std::isfinite(square)) return false;
  const DVec3 inward = across - along * (dot(across, along) / square);
  const double height = length(inward), texels = std::abs(area2(flat));
  if (!(height > 0) || !(texels > 0)) return false;
  edge.inward = Vec3(inward / height);
  edge.texel_size = static_cast<float>(std::sqrt(std::sqrt(square) * height / texels));
  return std::isfinite(edge.texel_size) && edge.texel_size > 0;
}

}  // namespace

std::vector<BorderEdge> border_edges(const Scene& scene, const Atlas& atlas) {
  // Sides of each set of charts once, with the mesh of any instance that has it.
  std::vector<const Mesh*> mesh_of(atlas.charts.size(), nullptr);
  for (size_t i = 0; i < scene.instances.size(); ++i)
    mesh_of[atlas.charts_of_instance[i]] = &scene.meshes[scene.instances[i].mesh];
  std::vector<std::vector<uint32_t>> sides(atlas.charts.size());
  parallel_for(sides.size(), [&](size_t c) {
    if (mesh_of[c]) sides[c] = border_sides(*mesh_of[c], atlas.charts[c]);
  });
  std::vector<std::vector<BorderEdge>> of_instance(scene.instances.size());
  parallel_for(of_instance.size(), [&](size_t i) {
    BorderEdge edge;
    for (const uint32_t corner : sides[atlas.charts_of_instance[i]])
      if (make_edge(scene, atlas, static_cast<uint32_t>(i), corner, edge)) of_instance[i].push_back(edge);
  });
  std::vector<BorderEdge> edges;
  for (const std::vector<BorderEdge>& part : of_instance) edges.insert(edges.end(), part.begin(), part.end());
  return edges;
}

}  // namespace kiln
