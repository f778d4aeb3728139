// The sets of features that integrators are compiled for: each combination of lights with Lambert materials,
// each with layered ones, area lights with all other lights and layered materials, and everything at once.
// They stand in files of their own, since each takes a while to compile.
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
