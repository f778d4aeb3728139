#include "coordinator/scene/import/cube_map.h"

#include <cstring>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "coordinator/scene/import/affine.h"

namespace kiln {
namespace {

// OpenGL 4.6, table 8.19, with s mirrored: the extension stores each face flipped about its vertical axis,
// which is how the faces look from inside in a right-handed world.
Vec3 sample(const std::array<CubeFace, 6>& faces, const DVec3& d) {
  const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
  size_t face;
  double s, t, major;
  if (ax >= ay && ax >= az) {
    face = d.x > 0 ? 0 : 1, major = ax, s = d.x > 0 ? d.z : -d.z, t = -d.y;
  } else if (ay >= az) {
    face = d.y > 0 ? 2 : 3, major = ay, s = -d.x, t = d.y > 0 ? d.z : -d.z;
  } else {
    face = d.z > 0 ? 4 : 5, major = az, s = d.z > 0 ? -d.x : d.x, t = -d.y;
  }
  const CubeFace& f = faces[face];
  const auto texel = [&](double coordinate) {
    const double at = (coordinate / major * 0.5 + 0.5) * f.size;
    return static_cast<size_t>(std::clamp(at, 0.0, f.size - 1.0));
  };
  return f.texels[texel(t) * f.size + texel(s)];
}

}  // namespace

Texture cube_to_equirectangular(const std::array<CubeFace, 6>& faces, const double (&rotation)[4]) {
  for (const CubeFace& face : faces)
    KILN_CHECK(face.size > 0 && face.texels.size() == size_t{face.size} * face.size);
  Texture out;
  out.name = "environment";
  out.width = 4 * faces[0].size;
  out.height = 2 * faces[0].size;
  out.channels = 3;
  out.format = TexelFormat::kFloat32;
  out.wrap_t = Wrap::kClamp;
  out.texels.resize(size_t{out.width} * out.height * sizeof(Vec3));
  const double inverse[4] = {-rotation[0], -rotation[1], -rotation[2], rotation[3]};
  const Affine to_cube = from_trs(DVec3(0), inverse, DVec3(1));
  constexpr double kTau = 6.28318530717958647692;
  constexpr uint32_t kSub = 4;  // samples a side in each texel: faces and rows never line up
  parallel_for(out.height, [&](size_t y) {
    for (uint32_t x = 0; x < out.width; ++x) {
      DVec3 sum(0);
      for (uint32_t k = 0; k < kSub * kSub; ++k) {
        const double u = (x + (k % kSub + 0.5) / kSub) / out.width,
                     v = (y + (k / kSub + 0.5) / kSub) / out.height;
        const double phi = (u - 0.5) * kTau, theta = v * kTau / 2;
        const DVec3 d(std::sin(phi) * std::sin(theta), std::cos(theta), -std::cos(phi) * std::sin(theta));
        sum += DVec3(sample(faces, to_cube.vector(d)));
      }
      const Vec3 mean(sum / double{kSub * kSub});
      std::memcpy(out.texels.data() + (y * out.width + x) * sizeof mean, &mean, sizeof mean);
    }
  });
  return out;
}

}  // namespace kiln
