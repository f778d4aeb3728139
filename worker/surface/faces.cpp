#include "worker/surface/faces.h"

namespace kiln {

// Sums of the magnitudes in the point's coordinates and Embree's edge vectors. Waechter & Binder
// (Ray Tracing Gems, ch. 6) step by 256 units in the last place of each coordinate; a plane near zero in one
// coordinate but long in the others then shows acne, because Embree's error grows with the triangle's extent.
// Departure: a step of 2^-17 of the largest magnitude over all axes.
float reach_error(const Mat4x3& to_world, const Vec3& reach) {
  const Vec3 sum = glm::abs(to_world[0]) * reach.x + glm::abs(to_world[1]) * reach.y +
                   glm::abs(to_world[2]) * reach.z + glm::abs(to_world[3]);
  return 0x1p-17f * max_component(sum);
}

std::vector<Face> make_faces(const Mesh& mesh, const Mat4x3* to_world) {
  std::vector<Face> faces(mesh.triangles.size());
  for (size_t i = 0; i < faces.size(); ++i) {
    Face& f = faces[i];
    const UVec3& t = mesh.triangles[i];
    Vec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = mesh.positions[t[k]];
    const Vec3 reach = glm::max(glm::max(glm::abs(p[0]), glm::abs(p[1])), glm::abs(p[2]));
    f.error = to_world ? reach_error(*to_world, reach) : 0.0f;
    // Computes the normal from the file's coordinates: far from the origin, transformed edges lose precision.
    Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
    if (to_world) {
      normal = transform_normal(*to_world, normal);
      for (Vec3& corner : p) corner = transform_point(*to_world, corner);
    }
    f.p0 = p[0];
    f.e1 = p[1] - p[0];
    f.e2 = p[2] - p[0];
    f.ng = normalize_or(normal, Vec3(0, 1, 0));
    f.smooth = false;
    for (int k = 0; k < 3; ++k) {
      const Vec3 n = mesh.normals[t[k]];
      f.n[k] = to_world ? transform_normal(*to_world, n)
                        : n;  // unnormalised, as if interpolated before the transform
      f.smooth = f.smooth || !(length(normalize_or(f.n[k], f.ng) - f.ng) <= 1e-5f);
      f.uv[k] = mesh.uv[0].empty() ? Vec2(0.0f) : mesh.uv[0][t[k]];
    }
  }
  return faces;
}

}  // namespace kiln
