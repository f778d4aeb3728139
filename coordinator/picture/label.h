// Small words in pictures.
#pragma once

#include <string_view>

#include "coordinator/picture/picture.h"

namespace kiln {

// Letters a to z, digits, space and .,:;_+-/%, 5 x 7 dots of `scale` pixels, 6 apart; others are left blank.
// What reaches over the picture is cut off.
void draw_label(Picture& picture, uint32_t left, uint32_t top, uint32_t scale, std::string_view text,
                const std::array<uint8_t, 3>& color);
uint32_t label_width(uint32_t scale, std::string_view text);
constexpr uint32_t kLabelHeight = 7;  // times scale

}  // namespace kiln
