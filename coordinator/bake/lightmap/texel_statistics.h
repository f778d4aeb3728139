// Measurements of every texel site in two replicates: independent halves of the samples, each with its own
// random numbers (and irradiance cache). Written by merge; read by the error estimate and the denoiser.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/zeroed.h"
#include "common/job/unit.h"

namespace kiln {

struct TexelStatistics {
  size_t sites = 0, planes = 0;               // planes: E.R E.G E.B, then the basis' (function major, R G B),
                                              // then direct light's if it is apart
  ZeroedVector<float> mean[kReplicates];      // [site][plane] of each replicate
  std::vector<float> luminance[kReplicates];  // [site] mean luminance of E of each replicate
  std::vector<float>
      variance;  // [site] variance of one sample's luminance of E, as if samples were independent
  std::vector<uint32_t> samples;  // [site] samples of each replicate; equal in both
  std::vector<uint8_t> known;     // [site] 0: inside geometry or without samples, so the values mean nothing
};

}  // namespace kiln
