// Maps a surface point, such as a ray hit, back to the texel site that contains it.
#pragma once

#include <limits>

#include "common/atlas/atlas_lookup.h"

namespace kiln {

class SiteLookup {
 public:
  static constexpr uint32_t kNone = ~0u;

  // `atlas` outlives the lookup; `scene` is read only by the constructor.
  SiteLookup(const Atlas& atlas, const Scene& scene);

  struct Place {
    uint32_t site = kNone;    // kNone: no texel was measured there
    float texel_size = 0.0f;  // metres: the mean over the chart
  };
  // The least texel size of an instance's charts, in metres; infinity if it has none. Known without a search.
  float least_texel_size(uint32_t instance) const {
    return instance < least_texel_size_.size() ? least_texel_size_[instance]
                                               : std::numeric_limits<float>::infinity();
  }
  // The texel that contains a triangle's point, given by barycentrics of vertices 1 and 2.
  Place find(uint32_t instance, uint32_t triangle, float b1, float b2) const;

 private:
  const Atlas& atlas_;
  std::vector<uint32_t> site_of_texel_;
  std::vector<float> texel_size_;        // by placement
  std::vector<float> least_texel_size_;  // by instance
  AtlasLookup places_;
};

}  // namespace kiln
