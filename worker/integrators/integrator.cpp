#include "worker/integrators/integrator.h"

#include "worker/integrators/roster.h"
#include "worker/integrators/visibility.h"

namespace kiln {

uint32_t find_features(const Surfaces& surfaces, const Lights& lights) {
  uint32_t features = 0;
  if (!lights.local.empty()) features |= kLocalLights;
  if (lights.local.has_area_lights()) features |= kAreaLights;
  if (!lights.directional.empty()) features |= kSuns;
  if (lights.environment.wants_sampling()) features |= kSkyImage;
  for (uint32_t i = 0; i < surfaces.scene().instances.size(); ++i) {
    if (surfaces.kind(i).glass) features |= kGlass;
    if (has_layers(surfaces.material(i))) features |= kLayers;
  }
  return features;
}

std::unique_ptr<Integrator> Integrator::create(const Surfaces& surfaces, const Tracer& tracer,
                                               const Lights& lights, const TransportSettings& settings,
                                               uint32_t features) {
  if (!settings.quantities.light) {
    if (!(features & kGlass)) return make_visibility(surfaces, tracer, settings);
    TransportSettings dark = settings;  // only the primary ray, continued through glass
    dark.direct = dark.indirect = false;
    return integrator_of_everything()(surfaces, tracer, lights, dark);
  }
  if (settings.mis_mode != MisMode::kBoth) features |= kOneStrategy;
  const bool everything = features & (kGlass | kOneStrategy);
  const IntegratorFactory factory = everything               ? integrator_of_everything()
                                    : features & kAreaLights ? integrator_of_area_lights()
                                    : features & kLayers     ? layered_integrators()[features & kAllLights]
                                                             : lambert_integrators()[features & kAllLights];
  return factory(surfaces, tracer, lights, settings);
}

}  // namespace kiln
