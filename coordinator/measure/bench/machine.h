#pragma once

#include <string>

namespace kiln {

// "AMD EPYC 7763, 2 processors": the model from /proc/cpuinfo, and the processors this process may use.
std::string machine_text();

}  // namespace kiln
