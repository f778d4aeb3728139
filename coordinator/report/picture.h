// 8-bit pictures, and words in them.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// Row 0 on top, 3 bytes a pixel.
struct Picture {
  uint32_t width = 0, height = 0;
  std::vector<uint8_t> rgb;

  // Components 0 to 255; pixels outside are left alone.
  void set(int64_t x, int64_t y, const Vec3& color) {
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    for (int c = 0; c < 3; ++c)
      rgb[(static_cast<size_t>(y) * width + static_cast<size_t>(x)) * 3 + static_cast<size_t>(c)] =
          static_cast<uint8_t>(color[c] + 0.5f);
  }
};

constexpr uint32_t kGlyphWidth = 12, kGlyphHeight = 14;  // pixels, with the gap to the next letter

// Digits, ".", "/", "-", "+" and the letters of "texels per metre, none"; others leave a gap. `x`, `y`: upper
// left corner.
void draw_words(Picture& picture, int64_t x, int64_t y, std::string_view words, const Vec3& color);

}  // namespace kiln
