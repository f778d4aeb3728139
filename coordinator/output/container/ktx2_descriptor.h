// The data format descriptor of a KTX2 file.
#pragma once

#include <vector>

#include "coordinator/output/container/texture_format.h"

namespace kiln {

// dfdTotalSize and one basic descriptor block (Khronos Data Format Specification 1.4, chapter 5): 32-bit
// words. Primaries BT.709, transfer linear, alpha straight. It is the same with supercompression: document
// revision 4 of KTX 2.0 keeps bytesPlane, which earlier ones set to 0.
std::vector<uint32_t> ktx2_descriptor(TextureFormat format);

// Type of one word of texels, which readers swap on big-endian machines: 1 of blocks.
uint32_t ktx2_type_size(TextureFormat format);

}  // namespace kiln
