// 8-bit pictures and what previews share in making them.
#pragma once

#include <array>
#include <functional>

#include "common/math/vec.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Row 0 on top.
struct Picture {
  Picture() = default;
  Picture(uint32_t w, uint32_t h, uint8_t grey) : width(w), height(h), rgb(size_t{w} * h * 3, grey) {}

  uint32_t width = 0, height = 0;
  std::vector<uint8_t> rgb;

  void set(uint32_t x, uint32_t y, const std::array<uint8_t, 3>& color) {
    std::copy(color.begin(), color.end(), &rgb[(size_t{y} * width + x) * 3]);
  }
  void paste(const Picture& p, uint32_t left, uint32_t top);  // must lie inside
};

constexpr uint32_t kSupersample = 2;  // per side

// A picture of the mean of fine^2 pixels each: `color` gives pixel i of the large one, 0 to 255. The mean is
// of displayed values, so that bright edges are smooth.
Picture supersampled(uint32_t width, uint32_t height, uint32_t fine,
                     const std::function<Vec3(size_t)>& color);

// The pages of the atlas side by side, scaled to at most `size` a side. Shrinks by any factor, grows by whole
// ones: small maps show their texels.
Picture page_sheet(const Lightmap& map, uint32_t size,
                   const std::function<std::array<uint8_t, 3>(size_t texel)>& color);

}  // namespace kiln
