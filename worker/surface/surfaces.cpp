#include "worker/surface/surfaces.h"

namespace kiln {

Expected<std::unique_ptr<Surfaces>> Surfaces::create(Scene scene, std::vector<std::string>& warnings) {
  auto s = std::make_unique<Surfaces>();
  s->scene_ = std::move(scene);
  for (const Record& record : s->scene_.materials) {
    KILN_TRY(Material material, parse_material(record, s->scene_, warnings));
    s->materials_.push_back(std::move(material));
  }
  s->make_kinds();
  s->make_covers();
  return s;
}

void Surfaces::make_kinds() {
  std::vector<uint32_t> uses(scene_.meshes.size(), 0);
  for (const Instance& i : scene_.instances) ++uses[i.mesh];
  std::vector<const Face*> shared(scene_.meshes.size(), nullptr);
  for (const Instance& i : scene_.instances) {
    const Mesh& mesh = scene_.meshes[i.mesh];
    const Material& material = materials_[i.material];
    const bool own = uses[i.mesh] == 1;
    if (!shared[i.mesh]) {
      faces_.push_back(make_faces(mesh, own ? &i.to_world : nullptr));
      shared[i.mesh] = faces_.back().data();
    }
    kinds_.push_back(
        {&material, shared[i.mesh], own ? nullptr : &i.to_world, is_double_sided(material),
         kiln::is_emissive(material), kiln::is_glass(material), reads_uv(material, 0) && !mesh.uv[0].empty(),
         !mesh.colors.empty() || reads_uv(material, 1) || (reads_uv(material, 0) && mesh.uv[0].empty()),
         normal_map_of(material)});
  }
}

void Surfaces::make_covers() {
  covers_.resize(kinds_.size());
  for (uint32_t i = 0; i < kinds_.size(); ++i) {
    if (!has_alpha(i)) continue;
    const Alpha& alpha = alpha_of(material(i));
    const size_t count = scene_.meshes[scene_.instances[i].mesh].triangles.size();
    covers_[i].reserve(count);
    for (uint32_t t = 0; t < count; ++t) {
      const Range r = alpha.bounds({attributes(i, t, 0, 0), attributes(i, t, 1, 0), attributes(i, t, 0, 1)});
      covers_[i].push_back(r.low >= 1.0f ? Cover::kOpaque : r.high <= 0.0f ? Cover::kClear : Cover::kMixed);
    }
  }
}

void Surfaces::texture_edges(uint32_t instance, uint32_t triangle, uint32_t set, Vec2& d1, Vec2& d2) const {
  const Mesh& m = scene_.meshes[scene_.instances[instance].mesh];
  d1 = d2 = Vec2(0.0f);
  if (m.uv[set].empty()) return;
  const UVec3& t = m.triangles[triangle];
  d1 = m.uv[set][t.y] - m.uv[set][t.x];
  d2 = m.uv[set][t.z] - m.uv[set][t.x];
}

Vec3 Surfaces::mapped_normal(uint32_t instance, uint32_t triangle, const SurfacePoint& at) const {
  const SurfaceKind& kind = kinds_[instance];
  const NormalMap& map = *kind.normal_map;
  const TextureUse& use = map.use();
  Vec2 uv1, uv2;
  texture_edges(instance, triangle, use.uv_set, uv1, uv2);
  const Vec2 d1(use.m[0] * uv1.x + use.m[1] * uv1.y, use.m[3] * uv1.x + use.m[4] * uv1.y);
  const Vec2 d2(use.m[0] * uv2.x + use.m[1] * uv2.y, use.m[3] * uv2.x + use.m[4] * uv2.y);
  const float determinant = d1.x * d2.y - d2.x * d1.y;
  const Face& f = kind.faces[triangle];
  Vec3 along_u = f.e1 * d2.y - f.e2 * d1.y, along_v = f.e2 * d1.x - f.e1 * d2.x;
  if (determinant < 0.0f) along_u = -along_u, along_v = -along_v;
  if (kind.to_world) {
    along_u = transform_vector(*kind.to_world, along_u);
    along_v = transform_vector(*kind.to_world, along_v);
  }
  const Vec3 x = normalize_or(along_u - at.ns * dot(along_u, at.ns), Vec3(0.0f));
  if (x == Vec3(0.0f)) return at.ns;  // coordinates without area: no tangent frame
  Vec3 y = cross(at.ns, x);           // in the file's convention: against increasing v
  if (dot(y, along_v) > 0.0f) y = -y;
  const Vec3 n = map.normal(at.attributes);
  const Vec3 tilted = normalize_or(x * n.x + y * n.y + at.ns * n.z, at.ns);
  return dot(tilted, at.ng) > 0.0f ? tilted : at.ns;
}

void Surfaces::corners(uint32_t instance, uint32_t triangle, Vec3 (&p)[3]) const {
  const SurfaceKind& kind = kinds_[instance];
  const Face& f = kind.faces[triangle];
  p[0] = f.p0, p[1] = f.p0 + f.e1, p[2] = f.p0 + f.e2;
  if (kind.to_world)
    for (Vec3& corner : p) corner = transform_point(*kind.to_world, corner);
}

void Surfaces::add_extras(uint32_t instance, uint32_t triangle, float b1, float b2, Attributes& a) const {
  const Mesh& m = scene_.meshes[scene_.instances[instance].mesh];
  const UVec3& t = m.triangles[triangle];
  const float b0 = 1.0f - b1 - b2;
  if (m.uv[0].empty()) a.uv[0] = Vec2(0.0f);
  a.uv[1] = m.uv[1].empty() ? Vec2(0.0f) : m.uv[1][t.x] * b0 + m.uv[1][t.y] * b1 + m.uv[1][t.z] * b2;
  if (!m.colors.empty()) a.color = m.colors[t.x] * b0 + m.colors[t.y] * b1 + m.colors[t.z] * b2;
}

void Surfaces::interpolate(uint32_t instance, uint32_t triangle, float b1, float b2, Attributes& a) const {
  // Writes everything that the material reads, because `point` may hold an earlier point.
  const SurfaceKind& kind = kinds_[instance];
  a.color = Vec4(1.0f);
  if (kind.textured) {
    const Face& f = kind.faces[triangle];
    a.uv[0] = f.uv[0] * (1.0f - b1 - b2) + f.uv[1] * b1 + f.uv[2] * b2;
  }
  if (kind.extras) add_extras(instance, triangle, b1, b2, a);
}

Transparency::Pass Surfaces::pass(uint32_t instance, uint32_t triangle, float b1, float b2,
                                  const Vec3& direction) const {
  const SurfacePoint at = this->at(instance, triangle, b1, b2);
  const Bsdf bsdf = bsdf_at(material(instance), at.attributes);
  const float cos = dot(direction, at.ng);
  return {straight_through(bsdf, std::abs(cos)), bsdf.absorption, cos < 0.0f};
}

void Surfaces::at(uint32_t instance, uint32_t triangle, float b1, float b2, SurfacePoint& s) const {
  const SurfaceKind& kind = kinds_[instance];
  const Face& f = kind.faces[triangle];
  // Offsets from p0 keep the rounding error to that of one vertex.
  s.position = f.p0 + f.e1 * b1 + f.e2 * b2;
  s.ng = s.ns = f.ng;
  s.error = f.error;
  if (f.smooth) s.ns = normalize_or(f.n[0] * (1.0f - b1 - b2) + f.n[1] * b1 + f.n[2] * b2, f.ng);
  if (kind.to_world) {
    const Mat4x3& m = *kind.to_world;
    const Vec3 a = glm::abs(f.p0);
    s.position = transform_point(m, s.position);
    s.error = reach_error(m, glm::max(glm::max(a, glm::abs(f.p0 + f.e1)), glm::abs(f.p0 + f.e2)));
    s.ng = normalize_or(transform_normal(m, s.ng), Vec3(0, 1, 0));
    s.ns = f.smooth ? normalize_or(transform_normal(m, s.ns), s.ng) : s.ng;
  }
  if (dot(s.ns, s.ng) <= 0.0f) s.ns = s.ng;  // a normal that contradicts its winding is ignored
  interpolate(instance, triangle, b1, b2, s.attributes);
}

}  // namespace kiln
