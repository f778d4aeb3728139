// Bakes probes of a scene made in code, without a farm.
#pragma once

#include "common/probes/field.h"
#include "coordinator/bake/probes/resolve.h"
#include "coordinator/scene/probes/probes.h"
#include "worker/bake/baker.h"

namespace kiln::test {

struct BakedField {
  ProbeField field;
  std::vector<std::array<float, kHarmonics>> difference;  // |A - B| / 2 of the replicates' luminance
};

// `samples` per replicate; `reach`: of every probe, metres.
BakedField bake_probes_at(Scene scene, const std::vector<Vec3>& places, uint32_t samples, bool visibility,
                          float reach = 100, uint64_t seed = 0);
// Of the probes of a layout that are not inside geometry; those get nothing.
ProbeField bake_layout(const Scene& scene, const ProbeLayout& layout, uint32_t samples, bool visibility);

}  // namespace kiln::test
