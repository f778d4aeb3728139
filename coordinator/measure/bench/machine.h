#pragma once

#include <string>

namespace kiln {

// "AMD EPYC 7763, 2 processors": the model as /proc/cpuinfo gives it, and those that this process may use.
std::string machine_text();

}  // namespace kiln
