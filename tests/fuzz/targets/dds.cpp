// A DDS file, with little room for texels.
#include "coordinator/output/container/container.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_dds(std::span<const std::byte> data) {
  const auto texture = read_dds(data, 1 << 16);
  require_sentence(texture);
  if (!texture) return;
  for (uint32_t level = 0; level < texture->levels.size(); ++level)
    for (const Bytes& image : texture->levels[level])
      require(image.size() == image_bytes(texture->format, std::max(1u, texture->width >> level),
                                          std::max(1u, texture->height >> level)),
              "as many bytes as the level takes");
  // What was understood can be written again, and is then the same.
  const auto again = read_ktx2(*write_ktx2(*texture, 1));
  require(again && again->levels == texture->levels, "a texture that was read can be written");
}

}  // namespace kiln::fuzz
