// Distant light: constant radiance or an equirectangular image, piecewise constant per texel and
// sampled in proportion to luminance.
#pragma once

#include "common/base/status.h"
#include "common/scene/record_reader.h"
#include "worker/lights/image_distribution.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class Environment {
 public:
  static constexpr std::string_view kType = "environment";
  // An environment without an image is constant. `record` may be null: black.
  static Expected<Environment> create(const Record* record, const Scene& scene,
                                      std::vector<std::string>& warnings);

  bool is_black() const { return black_; }
  // A constant environment needs no light sampling: sampling the surface is as good.
  bool wants_sampling() const { return !black_ && width_ > 0; }
  bool indirect_only() const { return bake_ == BakeMode::kIndirect; }
  // samples[k] for the random numbers (u[k], v[k]); at most kMax at once.
  static constexpr size_t kMax = ImageDistribution::kMax;
  void sample(const float* u, const float* v, size_t count, LightSample* samples) const;
  LightSample sample(const Vec2& u) const {
    LightSample s;
    sample(&u.x, &u.y, 1, &s);
    return s;
  }
  // Texel index of a unit direction; 0 without an image.
  uint32_t texel_of(const Vec3& direction) const;
  // Prefetches what radiance() and pdf() read for this direction.
  void prefetch(uint32_t texel) const {
    __builtin_prefetch(&texels_[texel]);
    distribution_.prefetch(texel % width_, texel / width_);
  }
  Vec3 radiance(uint32_t texel) const { return width_ ? texels_[texel] : constant_; }
  float pdf(uint32_t texel) const;  // of sample(), per steradian
  Vec3 radiance(const Vec3& direction) const { return radiance(texel_of(direction)); }
  float pdf(const Vec3& direction) const { return pdf(texel_of(direction)); }

 private:
  Vec3 constant_{0.0f};
  uint32_t width_ = 0, height_ = 0;
  std::vector<Vec3> texels_;
  // 1 - cos of the angles from the nearer pole to the row's two edges, the second being further
  // from +y; and the solid angle of a texel.
  struct Row {
    float first, second, solid_angle;
  };
  std::vector<Row> rows_;
  ImageDistribution distribution_;
  float turn_ = 0.0f;  // rotation about +Y in turns
  bool black_ = true;
  BakeMode bake_ = BakeMode::kFull;
};

}  // namespace kiln
