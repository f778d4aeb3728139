// A small depth-buffered rasteriser for previews: which triangle each pixel shows, and where on it.
#pragma once

#include <functional>
#include <vector>

#include "coordinator/output/look/fragment.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

struct View {
  uint32_t width = 0, height = 0;
  std::vector<Fragment> fragments;
};

// `visible` may reject a fragment (alpha tests, culling).
View rasterise(const Scene& scene, const Camera& camera, uint32_t width, uint32_t height,
               const std::function<bool(const Fragment&)>& visible);

}  // namespace kiln
