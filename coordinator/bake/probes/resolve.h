// From the sums of probes to what they hold.
#pragma once

#include <span>

#include "common/probes/field.h"
#include "coordinator/bake/merge/accumulator.h"

namespace kiln {

// The sums' errors, by site: standard error of the luminance of each coefficient, estimated like that of
// texels (coordinator/bake/sampling/texel_errors.h) from pairs of samples and from the replicates'
// difference; the root mean square of that of E over all normals, and the mean of E's luminance over them.
struct ProbeErrors {
  std::vector<std::array<float, kHarmonics>> coefficient;
  std::vector<float> irradiance, mean;
  // Samples per replicate.
  std::vector<uint32_t> samples;
};
// `volumes`: the volume of each site; neighbours that errors are estimated with are of the same one.
ProbeErrors probe_errors(const Accumulator& sums, std::span<const uint32_t> volumes);

// Writes what site i of the sums has to the field's probe probes[i].
void resolve_probes(const Accumulator& sums, const ProbeErrors& errors, std::span<const uint32_t> probes,
                    ProbeField& field);

}  // namespace kiln
