// Short labels in pictures.
#pragma once

#include <string_view>

#include "coordinator/picture/picture.h"

namespace kiln {

// Letters a to z, digits, space and .,:;_+-/%, in 5 x 7 dots of `scale` pixels, 6 apart; other
// characters are blank. Clipped at the picture's edges.
void draw_label(Picture& picture, uint32_t left, uint32_t top, uint32_t scale, std::string_view text,
                const std::array<uint8_t, 3>& color);
uint32_t label_width(uint32_t scale, std::string_view text);
constexpr uint32_t kLabelHeight = 7;  // times scale

}  // namespace kiln
