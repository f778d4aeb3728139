// Surface points of one texel, for many samples: shared work is done once.
#pragma once

#include "common/atlas/atlas.h"
#include "common/raster/triangle2.h"

namespace kiln {

class SitePicker {
 public:
  // `atlas` outlives the picker.
  SitePicker(const Atlas& atlas, uint32_t site);
  // As pick_site(atlas, site, u), bit for bit.
  SitePick pick(float u) { return at(index(u)); }
  uint32_t count() const { return count_; }  // valid points
  uint32_t index(float u) const {            // index of the point that pick(u) chooses
    return std::min(static_cast<uint32_t>(static_cast<float>(count_) * u), count_ - 1);
  }
  SitePick at(uint32_t index);
  // Twice the area, in texels, of the face of the last pick.
  double twice_texel_area() const { return whole_ < 0 ? -whole_ : whole_; }

 private:
  void enter(const uint32_t* pair);

  const Atlas& atlas_;
  const uint32_t* pairs_;              // of the site's record
  const uint32_t* entered_ = nullptr;  // the pair whose face the members below describe
  Triangle2 corners_;
  uint32_t triangle_ = 0;
  const FacePart* part_ = nullptr;
  double whole_ = 0;
  double x_, y_;  // of the texel
  uint32_t count_ = 0;
  uint8_t points_[64];  // the valid ones
};

}  // namespace kiln
