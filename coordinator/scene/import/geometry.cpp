#include "coordinator/scene/import/geometry.h"

#include <algorithm>

#include "common/scene/coincident.h"

namespace kiln {
namespace {

DVec3 area_normal(const std::vector<Vec3>& positions, const UVec3& t) {  // length: twice the area
  const DVec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
  return cross(b - a, c - a);
}

bool has_area(const std::vector<Vec3>& positions, const UVec3& t) {
  const DVec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
  const double longest = std::max({length(b - a), length(c - b), length(a - c)});
  double largest = 0;  // largest coordinate, which bounds the rounding
  for (const DVec3& p : {a, b, c}) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  constexpr double kHalfUlp = 0x1p-24;
  const double twice_area = length(area_normal(positions, t));
  return twice_area > 0 && twice_area > kHalfUlp * largest * longest;
}

Vec3 unit(const DVec3& v, const Vec3& fallback) {
  const double size = length(v);
  return size > 0 ? Vec3(v / size) : fallback;
}

template <class T>
void gather(std::vector<T>& values, const std::vector<uint32_t>& from) {
  if (values.empty()) return;
  std::vector<T> out;
  out.reserve(from.size());
  for (const uint32_t i : from) out.push_back(values[i]);
  values = std::move(out);
}

// Removes triangles for which `unwanted(index)`, called in order, is true; returns how many.
template <class Unwanted>
size_t remove_if_triangle(Triangles& triangles, const Unwanted& unwanted) {
  size_t kept = 0;
  for (size_t i = 0; i < triangles.vertices.size(); ++i) {
    if (unwanted(i)) continue;
    triangles.vertices[kept] = triangles.vertices[i];
    triangles.source[kept++] = triangles.source[i];
  }
  const size_t removed = triangles.vertices.size() - kept;
  triangles.vertices.resize(kept);
  triangles.source.resize(kept);
  if (removed > kept) {  // release the memory of millions for the few that are left
    triangles.vertices.shrink_to_fit();
    triangles.source.shrink_to_fit();
  }
  return removed;
}

// New vertex i is old vertex from[i].
void gather_vertices(Mesh& mesh, const std::vector<uint32_t>& from) {
  gather(mesh.positions, from);
  gather(mesh.normals, from);
  gather(mesh.tangents, from);
  gather(mesh.uv[0], from);
  gather(mesh.uv[1], from);
  gather(mesh.colors, from);
}

}  // namespace

Triangles triangulate(const std::vector<uint32_t>& indices, int mode) {
  Triangles out;
  const size_t count = mode == 4 ? indices.size() / 3 : indices.size() >= 3 ? indices.size() - 2 : 0;
  out.vertices.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    if (mode == 4)
      out.vertices.emplace_back(indices[3 * i], indices[3 * i + 1], indices[3 * i + 2]);
    else if (mode == 5)
      out.vertices.emplace_back(indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]);
    else
      out.vertices.emplace_back(indices[i + 1], indices[i + 2], indices[0]);
    out.source.push_back(static_cast<uint32_t>(i));
  }
  return out;
}

size_t remove_flat_triangles(const std::vector<Vec3>& positions, Triangles& triangles) {
  return remove_if_triangle(triangles, [&](size_t i) { return !has_area(positions, triangles.vertices[i]); });
}

size_t remove_repeated_triangles(const std::vector<Vec3>& positions, Triangles& triangles) {
  struct Key {
    uint64_t hash;
    uint32_t index;
    auto operator<=>(const Key&) const = default;
  };
  Vec3 a[3], b[3];
  const auto corners = [&](uint32_t i, Vec3(&p)[3]) {
    for (int k = 0; k < 3; ++k) p[k] = positions[triangles.vertices[i][k]];
  };
  std::vector<Key> keys(triangles.vertices.size());
  for (uint32_t i = 0; i < keys.size(); ++i) {
    corners(i, a);
    keys[i] = {corner_hash(a), i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<bool> repeated(keys.size());
  std::vector<uint32_t> firsts;  // with one hash: two if both windings occur
  for (size_t i = 0; i < keys.size(); ++i) {
    if (i == 0 || keys[i].hash != keys[i - 1].hash) firsts.clear();
    corners(keys[i].index, a);
    repeated[keys[i].index] = std::any_of(firsts.begin(), firsts.end(), [&](uint32_t first) {
      corners(first, b);
      return same_corners(a, b) == 1;
    });
    if (!repeated[keys[i].index]) firsts.push_back(keys[i].index);
  }
  return remove_if_triangle(triangles, [&](size_t i) { return repeated[i]; });
}

void make_flat_normals(Mesh& mesh) {
  std::vector<uint32_t> from;
  std::vector<Vec3> normals;
  from.reserve(mesh.triangles.size() * 3);
  for (UVec3& t : mesh.triangles) {
    const Vec3 normal = unit(area_normal(mesh.positions, t), Vec3(0, 1, 0));
    const auto first = static_cast<uint32_t>(from.size());
    from.insert(from.end(), {t.x, t.y, t.z});
    normals.insert(normals.end(), 3, normal);
    t = UVec3(first, first + 1, first + 2);
  }
  mesh.normals.clear();
  gather_vertices(mesh, from);
  mesh.normals = std::move(normals);
}

size_t repair_normals(Mesh& mesh) {
  std::vector<uint32_t> broken;
  for (uint32_t i = 0; i < mesh.normals.size(); ++i) {
    mesh.normals[i] = normalize_or(mesh.normals[i], Vec3(0));
    if (mesh.normals[i] == Vec3(0)) broken.push_back(i);
  }
  if (broken.empty()) return 0;
  std::vector<DVec3> sum(mesh.positions.size(), DVec3(0));
  for (const UVec3& t : mesh.triangles) {
    const DVec3 normal = area_normal(mesh.positions, t);
    for (const uint32_t v : {t.x, t.y, t.z}) sum[v] += normal;
  }
  for (const uint32_t v : broken) mesh.normals[v] = unit(sum[v], Vec3(0, 1, 0));
  return broken.size();
}

void drop_unused_vertices(Mesh& mesh) {
  constexpr uint32_t kUnused = ~0u;
  std::vector<uint32_t> to(mesh.positions.size(), kUnused), from;
  for (const UVec3& t : mesh.triangles) to[t.x] = to[t.y] = to[t.z] = 0;
  for (uint32_t v = 0; v < to.size(); ++v) {
    if (to[v] == kUnused) continue;
    to[v] = static_cast<uint32_t>(from.size());
    from.push_back(v);
  }
  if (from.size() == mesh.positions.size()) return;
  gather_vertices(mesh, from);
  for (UVec3& t : mesh.triangles) t = UVec3(to[t.x], to[t.y], to[t.z]);
}

}  // namespace kiln
