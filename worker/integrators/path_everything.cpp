#include "worker/integrators/make_path.h"

namespace kiln {

IntegratorFactory integrator_of_everything() {
  return make_path<kAllFeatures>;
}

}  // namespace kiln
