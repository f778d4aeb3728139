// Textures of every format, with bytes that differ from image to image.
#pragma once

#include "coordinator/output/container/container.h"

namespace kiln::test {

// Any bytes; `levels` 0: down to 1x1.
TextureImages picture(TextureFormat format, uint32_t width, uint32_t height, uint32_t layers, uint32_t levels,
                      uint32_t seed = 1);

uint32_t word_at(std::span<const std::byte> file, size_t offset);

}  // namespace kiln::test
