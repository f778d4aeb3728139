#include "coordinator/bake/post/stage.h"

namespace kiln {

std::span<const PostStage> post_stages() {
  static const PostStage kRoster[] = {
      {"fill", "invalid texels from measured texels of their chart", fill_invalid},
      {"seams", "both sides of chart borders made to agree, across objects too", join_seams},
      {"fit", "the basis made to show E at the surface's normals", fit_basis},
      {"dilate", "empty texels from their neighbours", dilate},
  };
  return kRoster;
}

}  // namespace kiln
