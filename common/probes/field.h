// What the probes of a bake hold, by probe.
#pragma once

#include <vector>

#include "common/probes/harmonics.h"
#include "common/probes/volume.h"
#include "common/responses/quantities.h"

namespace kiln {

constexpr uint32_t kIrradianceTexels = kIrradianceSide * kIrradianceSide;
constexpr uint32_t kDistanceTexels = kDistanceSide * kDistanceSide;

struct ProbeField {
  std::vector<Vec3> place;  // world, metres
  std::vector<ProbeState> state;
  std::vector<float> validity;   // share of directions that do not meet a back face
  std::vector<Harmonics> light;  // radiance; of inactive ones that of the probes which stand in, or 0
  // Standard error of the luminance of each coefficient, and the root mean square over all normals of that of
  // E; infinite where unknown.
  std::vector<std::array<float, kHarmonics>> error;
  std::vector<float> irradiance_error;
  std::vector<uint32_t> samples;
  // Octahedral maps without borders, row by row: E; mean and mean square of the distance, metres. Empty if no
  // volume has visibility.
  std::vector<Vec3> irradiance;  // [probe][kIrradianceTexels]
  std::vector<Vec2> distance;    // [probe][kDistanceTexels]
  size_t size() const { return place.size(); }
};

}  // namespace kiln
