// The estimator of bakes that ask for no light: one primary ray a sample and nothing behind it.
#pragma once

#include "worker/integrators/integrator.h"

namespace kiln {

// For scenes without glass, whose rays would go on. The rays, and so PrimaryRay, are those of the path tracer
// to the last bit.
std::unique_ptr<Integrator> make_visibility(const Surfaces& surfaces, const Tracer& tracer,
                                            const TransportSettings& settings);

}  // namespace kiln
