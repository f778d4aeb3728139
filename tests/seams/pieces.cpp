#include "tests/seams/pieces.h"

#include "common/math/trig.h"
#include "common/raster/footprint.h"

namespace kiln::test {
namespace {

// A flat polygon with a normal for each corner.
void polygon(Mesh& m, const std::vector<Vec3>& p, const std::vector<Vec3>& n) {
  const auto first = static_cast<uint32_t>(m.positions.size());
  for (size_t i = 0; i < p.size(); ++i) {
    m.positions.push_back(p[i]);
    m.normals.push_back(normalize_or(n[i], Vec3(0, 1, 0)));
  }
  const bool outwards = dot(cross(p[1] - p[0], p[2] - p[0]), n[0] + n[1] + n[2]) > 0;
  for (uint32_t i = 2; i < p.size(); ++i)
    m.triangles.push_back(outwards ? UVec3(first, first + i - 1, first + i)
                                   : UVec3(first, first + i, first + i - 1));
}

Mesh finished(Mesh m, const char* name) {
  m.name = name;
  for (uint32_t t = 0; t < m.triangles.size(); ++t) m.source_triangle.push_back(t);
  return m;
}

Vec3 axis_vector(int axis, float value) {
  Vec3 v(0.0f);
  v[axis] = value;
  return v;
}

}  // namespace

Mesh panel(float width, float height, uint32_t columns, uint32_t rows) {
  Mesh m;
  for (uint32_t y = 0; y <= rows; ++y)
    for (uint32_t x = 0; x <= columns; ++x) {
      const Vec2 q(static_cast<float>(x) / static_cast<float>(columns),
                   static_cast<float>(y) / static_cast<float>(rows));
      m.positions.push_back({q.x * width, q.y * height, 0});
      m.normals.push_back({0, 0, 1});
      m.uv[1].push_back(q);
    }
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < columns; ++x) {
      const uint32_t i = y * (columns + 1) + x;
      m.triangles.push_back({i, i + 1, i + columns + 1});
      m.triangles.push_back({i + 1, i + columns + 2, i + columns + 1});
    }
  return finished(std::move(m), "panel");
}

Mesh mantle(float radius, float height, uint32_t sides, double turns) {
  Mesh m;
  for (uint32_t k = 0; k <= sides; ++k) {
    const SinCos a = sincos_turns(static_cast<float>(turns * k / sides));
    for (const float y : {0.0f, height}) {
      m.positions.push_back({radius * a.cos, y, radius * a.sin});
      m.normals.push_back({a.cos, 0, a.sin});
    }
  }
  for (uint32_t k = 0; k < sides; ++k) {
    m.triangles.push_back({2 * k, 2 * k + 1, 2 * k + 2});
    m.triangles.push_back({2 * k + 1, 2 * k + 3, 2 * k + 2});
  }
  return finished(std::move(m), "mantle");
}

Mesh cube(float size) {
  Mesh m;
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      const Vec3 n = axis_vector(axis, sign), u = axis_vector((axis + 1) % 3, 1),
                 v = axis_vector((axis + 2) % 3, 1);
      std::vector<Vec3> p;
      for (const Vec3& corner : {n - u - v, n + u - v, n + u + v, n - u + v})
        p.push_back((corner + Vec3(0, 1, 0)) * (0.5f * size));
      polygon(m, p, {n, n, n, n});
    }
  return finished(std::move(m), "cube");
}

Mesh bevelled_box(float size, float bevel) {
  Mesh m;
  const float outer = 0.5f * size, inner = outer - bevel;
  // The corner of the face across `axis` beside the box's corner s (signs).
  const auto corner = [&](const Vec3& s, int axis) {
    Vec3 p = s * inner;
    p[axis] = s[axis] * outer;
    return p + Vec3(0, outer, 0);
  };
  const auto normal = [&](const Vec3& s, int axis) { return axis_vector(axis, s[axis]); };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const float sign : {-1.0f, 1.0f}) {
      std::vector<Vec3> p, n;
      for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        const Vec3 s = axis_vector(axis, sign) + axis_vector(u, static_cast<float>(a)) +
                       axis_vector(v, static_cast<float>(b));
        p.push_back(corner(s, axis));
        n.push_back(normal(s, axis));
      }
      polygon(m, p, n);
      for (const float other : {-1.0f, 1.0f}) {  // the bevel between the faces across axis and u
        const Vec3 s = axis_vector(axis, sign) + axis_vector(u, other);
        const Vec3 low = s + axis_vector(v, -1), high = s + axis_vector(v, 1);
        polygon(m, {corner(low, axis), corner(low, u), corner(high, u), corner(high, axis)},
                {normal(low, axis), normal(low, u), normal(high, u), normal(high, axis)});
      }
    }
  }
  for (int k = 0; k < 8; ++k) {
    const Vec3 s(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    polygon(m, {corner(s, 0), corner(s, 1), corner(s, 2)}, {normal(s, 0), normal(s, 1), normal(s, 2)});
  }
  return finished(std::move(m), "bevelled box");
}

Mat4x3 moved(const Vec3& to) {
  return Mat4x3(Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), to);
}

Pieces& Pieces::add(const Mesh& mesh, const Mat4x3& to_world) {
  scene.instances.push_back({static_cast<uint32_t>(scene.meshes.size()), 0, to_world,
                             mesh.name + std::to_string(scene.instances.size()), 0, 0, 0});
  scene.meshes.push_back(mesh);
  if (scene.materials.empty()) scene.materials.push_back({"metallic_roughness", "grey", Mat4x3(1.0f), {}});
  return *this;
}

Pieces wall_of_eight() {
  const Mesh plain = panel(2, 1.5f, 1, 1), fine = panel(2, 1.5f, 5, 4), odd = panel(2, 1.5f, 3, 1);
  Pieces w;
  w.add(plain, moved({0, 0, 0})).add(fine, moved({2, 0, 0}));
  w.add(odd, Mat4x3(Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(6, 0, 0)));        // mirrored
  w.add(plain, Mat4x3(Vec3(-1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(8, 1.5f, 0)));  // turned
  // Above: the cuts are at 1.3, 3.6 and 6.1 metres.
  w.add(panel(1.3f, 1.5f, 2, 2), moved({0, 1.5f, 0})).add(panel(2.3f, 1.5f, 1, 3), moved({1.3f, 1.5f, 0}));
  w.add(panel(2.5f, 1.5f, 4, 1), moved({3.6f, 1.5f, 0})).add(panel(1.9f, 1.5f, 1, 1), moved({6.1f, 1.5f, 0}));
  return w;
}

Atlas packed(const Scene& scene, float texels_per_metre) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = texels_per_metre;
  auto atlas = build_atlas(scene, settings);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  return *atlas;
}

Lightmap field_map(const Scene& scene, const Atlas& atlas,
                   const std::function<double(const DVec3&, const Vec3&)>& field) {
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  map.validity.assign(atlas.texel_count(), Validity::kEmpty);
  for (const char* name : {"E.R", "E.G", "E.B", "L1x.R", "error", "samples"}) map.planes.add(name);
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    const Mat4x3& m = scene.instances[i].to_world;
    const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
    for (size_t face = 0; face < charts.face_count(); ++face) {
      const ChartPlacement& place =
          atlas.placements[atlas.instance_first_chart[i] + charts.chart_of_face[face]];
      const Triangle2 t = texel_triangle(charts, place, face);
      Vec3 corner[3];
      face_corners(mesh, charts, face, corner);
      for_each_footprint_span(t, atlas.width, atlas.height, [&](uint32_t y, uint32_t x0, uint32_t x1) {
        for (uint32_t x = x0; x <= x1; ++x) {
          const size_t texel = (size_t{place.page} * atlas.height + y) * atlas.width + x;
          if (map.validity[texel] == Validity::kMeasured) continue;
          const DVec2 q(x + 0.5, y + 0.5);
          const double b1 = area2(t.c[0], q, t.c[2]) / area2(t), b2 = area2(t.c[0], t.c[1], q) / area2(t);
          DVec3 local(0.0);
          for (int k = 0; k < 3; ++k) local += DVec3(corner[k]) * (k == 0 ? 1 - b1 - b2 : k == 1 ? b1 : b2);
          const DVec3 p = DVec3(m[0]) * local.x + DVec3(m[1]) * local.y + DVec3(m[2]) * local.z + DVec3(m[3]);
          const auto e = static_cast<float>(
              field(p, transform_normal(m, mesh.normals[mesh.triangles[charts.triangle_of(face)].x])));
          const float values[6] = {e, e, e, e - 5, 0.01f * e, 64};
          for (int plane = 0; plane < 6; ++plane) map.planes.data[plane][texel] = values[plane];
          map.validity[texel] = Validity::kMeasured;
        }
      });
    }
  }
  return map;
}

}  // namespace kiln::test
