#include "coordinator/blocks/bc6h.h"

namespace kiln {
void encode_bc6h_ufloat(const BlockTexels&, const BlockChoice&, uint8_t*) {}
void encode_bc6h_sfloat(const BlockTexels&, const BlockChoice&, uint8_t*) {}
}  // namespace kiln
