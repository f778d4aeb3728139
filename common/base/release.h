// The number of this release, as people, files and peers read it. In one file, so that a program of another
// release can be linked from the same libraries (tests/faults).
#pragma once

#include <string>

namespace kiln {

const std::string& release_number();  // "0.1.0"

}  // namespace kiln
