// Surface points of the scene: position, normals and material.
#pragma once

#include "worker/accel/tracer.h"
#include "worker/materials/material.h"
#include "worker/surface/faces.h"

namespace kiln {

struct SurfacePoint {
  Vec3 position;
  Vec3 ng;      // unit, outer side by winding (mirrored instances stay right)
  Vec3 ns;      // unit, interpolated; on the side of ng
  float error;  // bound on the rounding of rays and point off the surface, metres
  Attributes attributes;
  // Falls back to ng where a path along `direction` would see the shading normal from below its horizon.
  void see_along(const Vec3& direction) {
    if (dot(direction, ns) >= 0.0f) ns = ng;
  }
};

// Properties of an instance that a path needs before its layers.
struct SurfaceKind {
  const Material* material;
  const Face* faces;
  const Mat4x3* to_world;  // null: the faces are in world space
  bool double_sided, emissive;
  bool glass;                   // transmits light straight: its back faces are hit from inside
  bool textured;                // reads TEXCOORD_0
  bool extras;                  // reads TEXCOORD_1, has vertex colours, or lacks the TEXCOORD_0 it reads
  const NormalMap* normal_map;  // or null
};

// Conservative class of a triangle by alpha: kMixed may turn out uniform.
enum class Cover : uint8_t { kOpaque, kClear, kMixed };

class Surfaces final : public Transparency {
 public:
  // Stores a reference to the scene and parses its materials. Warnings name unread properties.
  static Expected<std::unique_ptr<Surfaces>> create(Scene scene, std::vector<std::string>& warnings);

  const Scene& scene() const { return scene_; }
  const Material& material(uint32_t instance) const { return *kinds_[instance].material; }
  const SurfaceKind& kind(uint32_t instance) const { return kinds_[instance]; }

  // Hints that at() will be called for this triangle soon.
  void prefetch(uint32_t instance, uint32_t triangle) const {
    const Face* face = kinds_[instance].faces + triangle;
    __builtin_prefetch(face);
    __builtin_prefetch(&face->n);
  }
  SurfacePoint at(uint32_t instance, uint32_t triangle, float b1, float b2) const {
    SurfacePoint point;
    at(instance, triangle, b1, b2, point);
    return point;
  }
  // Writes in place: a copy right after the computation would stall on every store.
  void at(uint32_t instance, uint32_t triangle, float b1, float b2, SurfacePoint& out) const;
  Attributes attributes(uint32_t instance, uint32_t triangle, float b1, float b2) const {
    Attributes a;
    interpolate(instance, triangle, b1, b2, a);
    return a;
  }
  // The shading normal at a point returned by at(), perturbed by the material's normal map; on the side of
  // ng. The tangent frame is that of the triangle's own texture coordinates (not MikkTSpace's, whose tangents
  // are interpolated between triangles).
  Vec3 mapped_normal(uint32_t instance, uint32_t triangle, const SurfacePoint& at) const;
  // Whether a triangle needs an alpha test. Always kOpaque on instances without alpha.
  Cover cover(uint32_t instance, uint32_t triangle) const {
    const std::vector<Cover>& covers = covers_[instance];
    return covers.empty() ? Cover::kOpaque : covers[triangle];
  }
  // World-space corners.
  void corners(uint32_t instance, uint32_t triangle, Vec3 (&p)[3]) const;

  bool has_alpha(uint32_t instance) const override { return !is_opaque(material(instance)); }
  bool is_glass(uint32_t instance) const override { return kinds_[instance].glass; }
  Pass pass(uint32_t instance, uint32_t triangle, float b1, float b2, const Vec3& direction) const override;
  float opacity(uint32_t instance, uint32_t triangle, float b1, float b2) const override {
    return opacity_at(material(instance), attributes(instance, triangle, b1, b2));
  }

 private:
  Scene scene_;
  std::vector<Material> materials_;
  void make_kinds();
  void make_covers();
  void texture_edges(uint32_t instance, uint32_t triangle, uint32_t set, Vec2& d1, Vec2& d2) const;
  void interpolate(uint32_t instance, uint32_t triangle, float b1, float b2, Attributes& a) const;
  void add_extras(uint32_t instance, uint32_t triangle, float b1, float b2, Attributes& a) const;
  std::vector<std::vector<Face>> faces_;    // of a mesh shared by instances, or of one instance
  std::vector<SurfaceKind> kinds_;          // by instance
  std::vector<std::vector<Cover>> covers_;  // by instance; empty: without alpha
};

}  // namespace kiln
