// An image of a material, as embedded in a scene file.
#include "coordinator/scene/imageio/imageio.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_image(std::span<const std::byte> data) {
  const auto texture = decode_image(data, "x");
  require_sentence(texture);
  if (texture)
    require(texture->texels.size() == size_t{texture->width} * texture->height * texture->channels,
            "as many texels as the image says");
}

}  // namespace kiln::fuzz
