#include "common/base/release.h"

namespace kiln {

const std::string& release_number() {
  static const std::string number = KILN_VERSION;
  return number;
}

}  // namespace kiln
