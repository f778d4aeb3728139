#include "worker/integrators/make_path.h"

namespace kiln {

IntegratorFactory integrator_of_area_lights() {
  return make_path<kAllLights | kAreaLights | kLayers>;
}

}  // namespace kiln
