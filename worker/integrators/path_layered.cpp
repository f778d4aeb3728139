#include "worker/integrators/make_path.h"

namespace kiln {

const IntegratorTable& layered_integrators() {
  static constexpr IntegratorTable table = make_table<kLayers>();
  return table;
}

}  // namespace kiln
