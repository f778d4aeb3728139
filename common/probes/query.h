// The light of probes at a place: what engines evaluate, in C++. docs/shaders/kiln_probes.glsl is its twin.
#pragma once

#include <optional>
#include <span>

#include "common/probes/field.h"

namespace kiln {

struct ProbeQuery {
  // From the surface along its normal, in spacings of the brick: keeps the point off the surface that the
  // probes' distances end at.
  float bias = 0.1f;
  // By distances of volumes that have them; off: as if every probe saw everything.
  bool visibility = true;
  // E from octahedral maps of volumes that have them; off: from harmonics.
  bool octahedral = false;
};

struct ProbeLight {
  Vec3 irradiance{0.0f};
  // 1 inside a volume, falling to 0 at one of its coarsest spacings outside; 0: there are no probes.
  float weight = 0;
};

// Probes that light a point, and their shares, which add up to 1.
struct ProbeWeights {
  static constexpr uint32_t kMost = 8 * kMaxProbeLevels;
  std::array<uint32_t, kMost> probe{};
  std::array<float, kMost> weight{};
  uint32_t count = 0;
  float inside = 0;  // as ProbeLight::weight
};
// `normal`: that of the surface; none: an object around the point, as small as need be.
ProbeWeights query_weights(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                           const std::optional<Vec3>& normal, const ProbeQuery& settings = {});

// E at a point of a surface with that unit normal, from one volume. Between the 8 probes of a cell, weighted
// by: trilinear interpolation; the side of the surface they are on; whether their distances say that they see
// the point. (Majercik et al. 2019, section 5.2, with the numbers of its later code, RTXGI; departures: no
// view in the bias, no least weight of a probe that sees nothing but 10^-6, and blending is linear.) Inactive
// probes count for nothing. A brick beside a coarser one fades to that spacing over its last cell, so there
// is no step between them.
ProbeLight query_volume(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                        const Vec3& normal, const ProbeQuery& settings = {});

// Light at an object around the point; 0 where there is none. docs/examples/three/kiln_probes.js is its twin.
Harmonics query_harmonics(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                          const ProbeQuery& settings = {});

// The same as query_volume from all volumes: finer ones first, coarser ones where these fade out.
ProbeLight query_probes(std::span<const ProbeVolume> volumes, const ProbeField& field, const Vec3& position,
                        const Vec3& normal, const ProbeQuery& settings = {});

// Light at a point of the volume without a surface, by trilinear interpolation alone: for engines whose own
// lookup knows no more. Inactive probes count with the light of those that stand in for them. `at`: in finest
// spacings from the volume's corner.
Harmonics harmonics_in_air(const ProbeVolume& volume, const ProbeField& field, const DVec3& at);

}  // namespace kiln
