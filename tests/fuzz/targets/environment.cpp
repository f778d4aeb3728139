// An environment image, by what its first bytes say: EXR or Radiance HDR.
#include "coordinator/scene/imageio/imageio.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_environment(std::span<const std::byte> data) {
  const bool hdr = !data.empty() && data[0] == std::byte{'#'};
  const auto texture = read_environment(as_file(data, hdr ? ".hdr" : ".exr"));
  require_sentence(texture);
  if (!texture) return;
  const size_t values = size_t{texture->width} * texture->height * 3;
  require(texture->texels.size() == values * sizeof(float), "as many texels as the image says");
  for (size_t i = 0; i < values; ++i) {
    float value = 0;
    std::memcpy(&value, texture->texels.data() + i * sizeof value, sizeof value);
    require(value >= 0 && value <= std::numeric_limits<float>::max(), "radiance is finite and not negative");
  }
}

}  // namespace kiln::fuzz
