// The part of the scene that one pixel of a picture shows.
#pragma once

#include <cstdint>

namespace kiln {

struct Fragment {
  float inverse_depth = 0;  // 1 / distance along the view axis; 0: background
  uint32_t instance = 0, triangle = 0;
  float b1 = 0, b2 = 0;  // barycentrics of vertices 1 and 2, perspective-correct
  bool back = false;     // the camera sees the inner side
};

}  // namespace kiln
