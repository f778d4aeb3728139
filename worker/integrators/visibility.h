// The estimator for bakes without light: one primary ray per sample and nothing beyond it.
#pragma once

#include "worker/integrators/integrator.h"

namespace kiln {

// For scenes without glass, where rays end at the first surface. Rays and PrimaryRay equal the path
// tracer's to the last bit.
std::unique_ptr<Integrator> make_visibility(const Surfaces& surfaces, const Tracer& tracer,
                                            const TransportSettings& settings);

}  // namespace kiln
