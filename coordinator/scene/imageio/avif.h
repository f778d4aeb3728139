// AVIF pictures, for EXT_texture_avif. The only user of libavif.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "common/image/image.h"

namespace kiln {

bool is_avif(std::span<const std::byte> file);

// Decides about a size before anything of it is decoded.
using AllowSize = std::function<Status(uint32_t width, uint32_t height, uint32_t channels)>;

// The primary picture as kUnorm8, 3 channels, or 4 if it has alpha, which is not premultiplied. `name` is for
// messages.
Expected<Texture> decode_avif(std::span<const std::byte> file, const std::string& name,
                              const AllowSize& allow);

}  // namespace kiln
