// Fills a roster table.
#pragma once

#include <utility>

#include "worker/integrators/path.h"
#include "worker/integrators/roster.h"

namespace kiln {

template <uint32_t kFeatures>
std::unique_ptr<Integrator> make_path(const Surfaces& surfaces, const Tracer& tracer, const Lights& lights,
                                      const TransportSettings& settings) {
  return std::make_unique<PathIntegrator<kFeatures>>(surfaces, tracer, lights, settings);
}

// One entry for every combination of lights, with the features `kOthers`.
template <uint32_t kOthers, size_t... kLights>
constexpr IntegratorTable make_table(std::index_sequence<kLights...>) {
  return {make_path<kLights | kOthers>...};
}
template <uint32_t kOthers>
constexpr IntegratorTable make_table() {
  return make_table<kOthers>(std::make_index_sequence<kAllLights + 1>());
}

}  // namespace kiln
