// What was measured of every texel site, in two replicates: independent halves of the samples, each with
// random numbers (and an irradiance cache) of its own. Merge makes it; the stated error and the denoiser read
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/zeroed.h"
#include "common/job/unit.h"

namespace kiln {

struct TexelStatistics {
  size_t sites = 0, planes = 0;               // planes: E.R E.G E.B, then the basis' (function major, R G B)
  ZeroedVector<float> mean[kReplicates];      // [site][plane] of each replicate
  std::vector<float> luminance[kReplicates];  // [site] mean luminance of E of each replicate
  std::vector<float> variance;  // [site] of the luminance of E of one sample, as if samples were independent
  std::vector<uint32_t> samples;  // [site] of each replicate: both have as many
  std::vector<uint8_t> known;     // [site] 0: inside geometry, or without samples: means nothing
};

}  // namespace kiln
