// Probe volumes as Bevy's irradiance volumes.
#pragma once

#include "common/probes/field.h"
#include "coordinator/output/container/container.h"

namespace kiln {

// An ambient cube a voxel, as a 3-D texture of (Rx, 2 Ry, 3 Rz) texels of RGB9E5. The layout is that of the
// lookup in Bevy's crates/bevy_pbr/src/light_probe/irradiance_volume.wesl: z holds the voxels lit along x,
// then y, then z; y holds the sides with a normal of +x, +y, +z, then those of -x, -y, -z. (The comment in
// irradiance_volume.rs has the latter the other way round.) Texels are E / pi of a surface that faces that
// way: Bevy multiplies by the base colour. Voxels are centred on probes of the finest spacing, or every
// 2^n-th of them where the texture would be too large; between probes of coarser bricks light is
// interpolated.
struct BevyVolume {
  TextureImages texture;
  UVec3 voxels{0};
  DVec3 centre{0.0}, size{0.0};  // world; the Transform's translation and scale
};
constexpr uint32_t kMostVolumeSide = 2048;  // of a 3-D texture: wgpu's default limit
Expected<BevyVolume> bevy_volume(const ProbeVolume& volume, const ProbeField& field);

// Bevy's lookup in C++: E / pi at a point of the volume for a unit normal, by the texels of the file.
Vec3 bevy_lookup(const BevyVolume& volume, const Vec3& position, const Vec3& normal);

}  // namespace kiln
