// 8-bit pictures and what previews share to make them.
#pragma once

#include <array>
#include <functional>

#include "common/math/vec.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Row 0 is the top row.
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

// A picture in which each pixel is the mean of fine^2 pixels; `color` gives pixel i of the large
// picture, 0 to 255, and is called by several threads. Displayed values are averaged, so that bright edges
// are smooth.
Picture supersampled(uint32_t width, uint32_t height, uint32_t fine,
                     const std::function<Vec3(size_t)>& color);

// The atlas pages side by side, scaled to at most `size` pixels a side. Shrinks by any factor but
// grows by integer factors only, so that small maps show their texels.
Picture page_sheet(const Lightmap& map, uint32_t size,
                   const std::function<std::array<uint8_t, 3>(size_t texel)>& color);

}  // namespace kiln
