// Random numbers of many samples of one texel at once: bit for bit those of their SampleStreams, several
// times faster, since a dimension's scrambles are found once and the samples run side by side in vector
// registers.
#pragma once

#include <cstddef>

#include "common/math/sequence.h"

namespace kiln {

class SampleBatch {
 public:
  static constexpr size_t kMost = 64;

  // Samples that are added share the job's seed and the texel.
  void clear() { count_ = 0; }
  void add(const SampleStream& stream) {
    if (count_ == 0) stream_ = stream;
    reversed_[count_++] = stream.reversed_;
  }
  // x[k], y[k]: the pair of the sample that was added as number chosen[k].
  void pairs(uint32_t dimension, const uint32_t* chosen, size_t count, float* x, float* y) const;
  void singles(uint32_t dimension, const uint32_t* chosen, size_t count, float* x) const;

 private:
  SampleStream stream(size_t i) const;
  SampleStream stream_;  // of the first sample
  uint32_t reversed_[kMost];
  size_t count_ = 0;
};

}  // namespace kiln
