// The feature sets that integrators are compiled for: each combination of lights with Lambert and
// with layered materials; area lights with all other lights and layered materials; and everything
// at once. Each has its own file because it takes a while to compile.
#pragma once

#include <array>

#include "worker/integrators/integrator.h"

namespace kiln {

using IntegratorFactory = std::unique_ptr<Integrator> (*)(const Surfaces&, const Tracer&, const Lights&,
                                                          const TransportSettings&);
constexpr uint32_t kAllLights = kLocalLights | kSuns | kSkyImage;
using IntegratorTable = std::array<IntegratorFactory, kAllLights + 1>;  // indexed by the lights' features

const IntegratorTable& lambert_integrators();
const IntegratorTable& layered_integrators();
IntegratorFactory integrator_of_area_lights();
IntegratorFactory integrator_of_everything();

}  // namespace kiln
