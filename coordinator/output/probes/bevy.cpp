#include "coordinator/output/probes/bevy.h"

#include <cstring>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/probes/query.h"
#include "coordinator/output/textures/pixel_codes.h"

namespace kiln {
namespace {

constexpr uint32_t kSides = 6;  // +x, +y, +z, -x, -y, -z

Vec3 side_normal(uint32_t side) {
  Vec3 n(0.0f);
  n[static_cast<int>(side % 3)] = side < 3 ? 1.0f : -1.0f;
  return n;
}

// The texel of a voxel's side.
UVec3 texel_of(const UVec3& voxels, const UVec3& at, uint32_t side) {
  return {at.x, at.y + side / 3 * voxels.y, at.z + side % 3 * voxels.z};
}

Vec3 read_texel(const BevyVolume& v, const UVec3& t) {
  uint32_t bits;
  std::memcpy(&bits, &v.texture.levels[0][t.z][4 * (t.x + size_t{t.y} * v.texture.width)], sizeof bits);
  float rgb[3];
  from_rgb9e5(bits, rgb);
  return {rgb[0], rgb[1], rgb[2]};
}

}  // namespace

Expected<BevyVolume> bevy_volume(const ProbeVolume& volume, const ProbeField& field) {
  BevyVolume out;
  uint32_t step = 1;
  const UVec3 last = volume.roots * volume.root_size();
  const auto is_too_large = [&] {
    out.voxels = last / step + UVec3(1);
    return std::max({out.voxels.x, 2 * out.voxels.y, 3 * out.voxels.z}) > kMostVolumeSide;
  };
  while (is_too_large()) step *= 2;
  const double side = step * volume.spacing;
  out.size = DVec3(out.voxels) * side;
  out.centre = volume.low - DVec3(0.5 * side) + 0.5 * out.size;
  TextureImages& t = out.texture;
  t.format = TextureFormat::kRgb9e5;
  t.width = out.voxels.x;
  t.height = 2 * out.voxels.y;
  t.is_volume = true;
  t.levels.assign(1, std::vector<Bytes>(3 * size_t{out.voxels.z}, Bytes(size_t{4} * t.width * t.height)));
  parallel_for(out.voxels.z, [&](size_t z) {
    for (uint32_t y = 0; y < out.voxels.y; ++y)
      for (uint32_t x = 0; x < out.voxels.x; ++x) {
        const UVec3 at(x, y, static_cast<uint32_t>(z));
        const Harmonics light = harmonics_in_air(volume, field, DVec3(at * step));
        for (uint32_t s = 0; s < kSides; ++s) {
          const Vec3 e = glm::max(harmonic_irradiance(light, side_normal(s)) * kInvPi, Vec3(0.0f));
          const float rgb[3] = {e.x, e.y, e.z};
          const uint32_t bits = to_rgb9e5(rgb);
          const UVec3 texel = texel_of(out.voxels, at, s);
          std::memcpy(&t.levels[0][texel.z][4 * (texel.x + size_t{texel.y} * t.width)], &bits, sizeof bits);
        }
      }
  });
  return out;
}

Vec3 bevy_lookup(const BevyVolume& v, const Vec3& position, const Vec3& normal) {
  const DVec3 voxels(v.voxels);
  const DVec3 unit = (DVec3(position) - v.centre) / v.size + DVec3(0.5);
  const DVec3 at = glm::clamp(unit * voxels, DVec3(0.5), voxels - DVec3(0.5)) - DVec3(0.5);
  const UVec3 low = glm::min(UVec3(at), v.voxels - UVec3(1)),
              high = glm::min(low + UVec3(1), v.voxels - UVec3(1));
  const Vec3 share(at - DVec3(low));
  Vec3 sum(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const uint32_t side = static_cast<uint32_t>(axis) + (normal[axis] < 0.0f ? 3 : 0);
    for (uint32_t corner = 0; corner < 8; ++corner) {
      UVec3 c;
      float weight = normal[axis] * normal[axis];
      for (int k = 0; k < 3; ++k) {
        const bool upper = corner >> k & 1;
        c[k] = upper ? high[k] : low[k];
        weight *= upper ? share[k] : 1 - share[k];
      }
      sum += weight * read_texel(v, texel_of(v.voxels, c, side));
    }
  }
  return sum;
}

}  // namespace kiln
