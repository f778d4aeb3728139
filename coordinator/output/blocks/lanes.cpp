#include "coordinator/output/blocks/lanes.h"

namespace kiln {

BlockLanes block_lanes(const BlockTexels& texels, BlockMetric metric) {
  BlockLanes lanes;
  float most = 0;
  for (const float weight : texels.weight) most = std::max(most, weight);
  for (int i = 0; i < 16; ++i) {
    lanes.weight[i] = most > 0 ? std::max(0.0f, texels.weight[i]) / most : 1.0f;
    for (int c = 0; c < 4; ++c) lanes.v[c][i] = in_byte(255.0f * texels.rgba[i][c]);
  }
  const bool luminance = metric == BlockMetric::kPerceptual;
  constexpr float kShares[3] = {3 * 0.2126f, 3 * 0.7152f, 3 * 0.0722f};
  for (int c = 0; c < 4; ++c) lanes.channel[c] = luminance && c < 3 ? kShares[c] : 1.0f;
  return lanes;
}

}  // namespace kiln
