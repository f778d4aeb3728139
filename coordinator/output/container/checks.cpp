#include "coordinator/output/container/checks.h"

#include <algorithm>
#include <bit>

#include "common/base/format.h"

namespace kiln {

uint32_t most_levels(uint32_t width, uint32_t height) {
  return static_cast<uint32_t>(std::bit_width(std::max(width, height)));
}

tl::unexpected<Error> bad_texture(std::string what) {
  return fail(ErrorKind::kInvalidInput, std::move(what));
}

Status check_sizes(uint32_t width, uint32_t height, uint32_t layers, uint32_t levels) {
  if (width < 1 || height < 1 || width > kMaxTextureSide || height > kMaxTextureSide)
    return bad_texture(
        text("the texture has {} x {} texels, its sides must be 1 to {}", width, height, kMaxTextureSide));
  if (layers < 1 || layers > kMaxTextureLayers)
    return bad_texture(text("the texture has {} layers, it must have 1 to {}", layers, kMaxTextureLayers));
  if (levels < 1 || levels > most_levels(width, height))
    return bad_texture(text("the texture has {} levels, {} x {} texels have 1 to {}", levels, width, height,
                            most_levels(width, height)));
  return {};
}

uint64_t texture_bytes(TextureFormat format, uint32_t width, uint32_t height, uint32_t layers,
                       uint32_t levels) {
  uint64_t bytes = 0;
  for (uint32_t level = 0; level < levels; ++level)
    bytes += image_bytes(format, level_side(width, level), level_side(height, level));
  return bytes * layers;
}

Status check_images(const TextureImages& t) {
  // Compares vector sizes before narrowing them to 32 bits.
  if (t.levels.size() > 32 || (!t.levels.empty() && t.levels.front().size() > kMaxTextureLayers))
    return bad_texture(text("the texture has {} levels of {} layers, there can be 15 of {}", t.levels.size(),
                            t.levels.front().size(), kMaxTextureLayers));
  KILN_TRY_STATUS(check_sizes(t.width, t.height, t.layers(), static_cast<uint32_t>(t.levels.size())));
  for (uint32_t level = 0; level < t.levels.size(); ++level) {
    const uint64_t size = image_bytes(t.format, level_side(t.width, level), level_side(t.height, level));
    if (t.levels[level].size() != t.layers())
      return bad_texture(text("level {} of the texture has {} layers, level 0 has {}", level,
                              t.levels[level].size(), t.layers()));
    for (uint32_t layer = 0; layer < t.layers(); ++layer)
      if (t.levels[level][layer].size() != size)
        return bad_texture(text("level {}, layer {} of the texture has {} bytes, {} take {}", level, layer,
                                t.levels[level][layer].size(), texture_format(t.format).name, size));
  }
  return {};
}

}  // namespace kiln
