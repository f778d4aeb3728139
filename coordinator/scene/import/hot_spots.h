// Detects a sun left in an environment image.
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace kiln {

struct HotSpot {
  double share;        // of the light of the whole sphere, by luminance
  double solid_angle;  // steradians of its texels
  Vec3 direction;      // unit, to their centre, in the image's own frame (not rotated)
};

// Finds texels more than 100 times brighter than the mean, if they hold a tenth of the light or more.
// `image` is an equirectangular kFloat32 image of 3 channels or more.
std::optional<HotSpot> find_hot_spot(const Texture& image);

}  // namespace kiln
