// Random numbers of many samples at once, bit for bit those of their SampleStreams. Several times faster for
// samples of one texel: the scrambles of a dimension are computed once and samples run side by side in vector
// registers.
#pragma once

#include <cstddef>

#include "common/math/sequence.h"

namespace kiln {

class SampleBatch {
 public:
  static constexpr size_t kMax = 64;

  // All added samples use the same sampler.
  void clear() {
    count_ = 0;
    one_texel_ = true;
  }
  void add(const SampleStream& stream) {
    if (count_ == 0) stream_ = stream;
    one_texel_ = one_texel_ && stream.key_ == stream_.key_;
    key_[count_] = stream.key_;
    reversed_[count_++] = stream.reversed_;
  }
  // x[k], y[k]: the pair of the sample that was added as number chosen[k].
  void pairs(uint32_t dimension, const uint32_t* chosen, size_t count, float* x, float* y) const;
  void singles(uint32_t dimension, const uint32_t* chosen, size_t count, float* x) const;

 private:
  SampleStream stream(size_t i) const;
  bool is_vectorised() const { return one_texel_ && stream_.sampler_ == Sampler::kOwen; }
  SampleStream stream_;  // of the first sample
  uint64_t key_[kMax];
  uint32_t reversed_[kMax];
  size_t count_ = 0;
  bool one_texel_ = true;
};

}  // namespace kiln
