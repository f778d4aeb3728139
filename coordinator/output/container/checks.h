// Checks that both containers apply to textures, on writing and on reading.
#pragma once

#include "coordinator/output/container/container.h"

namespace kiln {

constexpr uint32_t kMaxTextureSide = 16384;   // Direct3D 12 and most of Vulkan's devices
constexpr uint32_t kMaxTextureLayers = 2048;  // the same

inline uint32_t level_side(uint32_t side, uint32_t level) {
  return level < 32 && side >> level ? side >> level : 1;
}
uint32_t most_levels(uint32_t width, uint32_t height);  // down to 1x1

tl::unexpected<Error> bad_texture(std::string what);  // kInvalidInput

// Checks the sizes in a file: 1 to the limits, and no more levels than the size has.
Status check_sizes(uint32_t width, uint32_t height, uint32_t layers, uint32_t levels);
// Bytes of all images; sizes must have been checked.
uint64_t texture_bytes(TextureFormat format, uint32_t width, uint32_t height, uint32_t layers,
                       uint32_t levels);
// Checks a texture before writing: the above, and the size of every image.
Status check_images(const TextureImages& texture);

}  // namespace kiln
