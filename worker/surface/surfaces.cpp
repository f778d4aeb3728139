#include "worker/surface/surfaces.h"

namespace kiln {

Expected<std::unique_ptr<Surfaces>> Surfaces::create(Scene scene, std::vector<std::string>& warnings) {
  auto s = std::make_unique<Surfaces>();
  s->scene_ = std::move(scene);
  for (const Record& record : s->scene_.materials) {
    KILN_TRY(Material material, parse_material(record, s->scene_, warnings));
    s->materials_.push_back(std::move(material));
  }
  for (const Instance& i : s->scene_.instances) {
    const Material& material = s->materials_[i.material];
    s->kinds_.push_back({&material, is_double_sided(material), kiln::is_emissive(material)});
  }
  return s;
}

void Surfaces::corners(uint32_t instance, uint32_t triangle, Vec3 (&p)[3]) const {
  const Instance& i = scene_.instances[instance];
  const Mesh& m = scene_.meshes[i.mesh];
  const UVec3& t = m.triangles[triangle];
  for (int k = 0; k < 3; ++k) p[k] = transform_point(i.to_world, m.positions[t[k]]);
}

Attributes Surfaces::attributes(uint32_t instance, uint32_t triangle, float b1, float b2) const {
  const Mesh& m = scene_.meshes[scene_.instances[instance].mesh];
  const UVec3& t = m.triangles[triangle];
  const float b0 = 1.0f - b1 - b2;
  Attributes a;
  for (int set = 0; set < 2; ++set)
    if (!m.uv[set].empty()) a.uv[set] = m.uv[set][t.x] * b0 + m.uv[set][t.y] * b1 + m.uv[set][t.z] * b2;
  if (!m.colors.empty()) a.color = m.colors[t.x] * b0 + m.colors[t.y] * b1 + m.colors[t.z] * b2;
  return a;
}

SurfacePoint Surfaces::at(uint32_t instance, uint32_t triangle, float b1, float b2) const {
  const Instance& i = scene_.instances[instance];
  const Mesh& m = scene_.meshes[i.mesh];
  const UVec3& t = m.triangles[triangle];
  const Vec3 &p0 = m.positions[t.x], &p1 = m.positions[t.y], &p2 = m.positions[t.z];
  SurfacePoint s;
  // Offsets from p0 keep the rounding error to that of one vertex.
  s.position = transform_point(i.to_world, p0 + (p1 - p0) * b1 + (p2 - p0) * b2);
  // Sums of magnitudes that enter the point's coordinates and Embree's edge vectors. Waechter & Binder
  // (Ray Tracing Gems, ch. 6) step by 256 units in the last place of each coordinate; a plane near a
  // coordinate's zero but long in the others then acnes, since Embree's error grows with the triangle's
  // extent. Departure: the largest magnitude of all axes counts, and a step of 2^-17 of it.
  const Vec3 reach = glm::max(glm::max(glm::abs(p0), glm::abs(p1)), glm::abs(p2));
  const Vec3 sum = glm::abs(i.to_world[0]) * reach.x + glm::abs(i.to_world[1]) * reach.y +
                   glm::abs(i.to_world[2]) * reach.z + glm::abs(i.to_world[3]);
  s.error = 0x1p-17f * max_component(sum);
  s.ng = normalize_or(transform_normal(i.to_world, cross(p1 - p0, p2 - p0)), Vec3(0, 1, 0));
  const Vec3 n = m.normals[t.x] * (1.0f - b1 - b2) + m.normals[t.y] * b1 + m.normals[t.z] * b2;
  s.ns = normalize_or(transform_normal(i.to_world, n), s.ng);
  if (dot(s.ns, s.ng) <= 0.0f) s.ns = s.ng;  // a normal that contradicts its winding says nothing
  s.attributes = attributes(instance, triangle, b1, b2);
  return s;
}

}  // namespace kiln
