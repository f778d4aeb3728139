#include "worker/integrators/make_path.h"

namespace kiln {

const IntegratorTable& lambert_integrators() {
  static constexpr IntegratorTable table = make_table<0>();
  return table;
}

}  // namespace kiln
