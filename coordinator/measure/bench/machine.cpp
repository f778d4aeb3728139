#include "coordinator/measure/bench/machine.h"

#include <fstream>

#include "common/base/format.h"
#include "common/base/parallel.h"

namespace kiln {

std::string machine_text() {
  std::string model = "unknown processor";
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (const size_t colon = line.find(": "); line.starts_with("model name") && colon != line.npos) {
      model = line.substr(colon + 2);
      break;
    }
  const unsigned n = hardware_threads();
  return text("{}, {} processor{}", model, n, n == 1 ? "" : "s");
}

}  // namespace kiln
