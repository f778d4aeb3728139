#include "tests/container/pictures.h"

#include <algorithm>
#include <cstring>
#include <random>

namespace kiln::test {

TextureImages picture(TextureFormat format, uint32_t width, uint32_t height, uint32_t layers, uint32_t levels,
                      uint32_t seed) {
  std::mt19937 random(seed);
  TextureImages t{format, width, height, {}};
  for (uint32_t level = 0; levels == 0 || level < levels; ++level) {
    const uint32_t w = std::max(1u, width >> level), h = std::max(1u, height >> level);
    auto& images = t.levels.emplace_back(layers);
    for (Bytes& image : images) {
      image.resize(image_bytes(format, w, h));
      for (std::byte& b : image) b = static_cast<std::byte>(random());
    }
    if (w == 1 && h == 1) break;
  }
  return t;
}

uint32_t word_at(std::span<const std::byte> file, size_t offset) {
  uint32_t word;
  std::memcpy(&word, &file[offset], 4);
  return word;
}

}  // namespace kiln::test
