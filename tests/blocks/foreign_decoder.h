// Blocks through OpenImageIO's reader of DDS files.
#pragma once

#include "coordinator/output/container/container.h"

namespace kiln::test {

// Bytes of RGBA, 64 a block, row by row.
std::vector<uint8_t> foreign_bytes(TextureFormat format, const Bytes& blocks);
std::vector<float> foreign_floats(TextureFormat format, const Bytes& blocks);  // the same of formats of halfs

}  // namespace kiln::test
