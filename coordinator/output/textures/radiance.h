// Radiance HDR files (Ward, "The RADIANCE Picture File Format"): run-length coded scan lines of RGBE texels.
#pragma once

#include <span>

#include "common/base/bytes.h"

namespace kiln {

// `rgbe`: 4 bytes a texel, row 0 on top. Our own writer, because the file must hold exactly the measured
// texels: libraries pack floats with their own rounding.
Bytes write_radiance(uint32_t width, uint32_t height, std::span<const std::byte> rgbe);

}  // namespace kiln
