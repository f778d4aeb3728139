// A small depth-buffered rasteriser for previews: which triangle each pixel shows, and where on it.
#pragma once

#include <functional>
#include <vector>

#include "coordinator/import/import.h"

namespace kiln {

struct Fragment {
  float inverse_depth = 0;  // 1 / distance along the view axis; 0: background
  uint32_t instance = 0, triangle = 0;
  float b1 = 0, b2 = 0;  // barycentrics of vertices 1 and 2, perspective-correct
  bool back = false;     // the camera sees the inner side
};

struct View {
  uint32_t width = 0, height = 0;
  std::vector<Fragment> fragments;
};

// `visible` may reject a fragment (alpha tests, culling).
View rasterise(const Scene& scene, const Camera& camera, uint32_t width, uint32_t height,
               const std::function<bool(const Fragment&)>& visible);

}  // namespace kiln
