// Component types of glTF accessors (specification, 3.6.2.2).
#pragma once

#include <cstddef>

namespace kiln {

// Bytes of one component; 0: no such type.
size_t component_bytes(int type);

}  // namespace kiln
