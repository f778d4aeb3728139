// Alpha, shared by all materials (glTF 2.0, 3.9.4): a factor, its texture and a mode; and light that a
// covered surface lets through all the same.
#pragma once

#include "worker/materials/attributes.h"

namespace kiln {

class Alpha {
 public:
  Alpha() = default;
  // `texture` is the base colour's.
  Alpha(RecordReader& r, float factor, const TextureSampler& texture) : factor_(factor), texture_(texture) {
    const std::string word = r.word("alpha_mode", "opaque");
    mode_ = word == "mask" ? kMask : word == "blend" ? kBlend : kOpaque;
    cutoff_ = r.number("alpha_cutoff", 0.5f);
    if (mode_ != kOpaque && texture_) whole_ = texture_.alpha_range();
  }
  // The covered part transmits this share of the light (times the texture's R).
  void let_through(float share, const TextureSampler& texture) {
    through_ = share;
    through_texture_ = share > 0.0f ? texture : TextureSampler();
  }
  bool is_opaque() const { return mode_ == kOpaque && through_ == 0.0f; }
  bool reads_uv(uint32_t set) const { return through_texture_.reads_uv(set); }
  float opacity(const Attributes& a) const {
    if (through_ == 0.0f) return coverage(a);
    return coverage(a) * (1.0f - (through_texture_ ? through_ * through_texture_.color(a.uv).x : through_));
  }
  // Conservative bounds of opacity() over a triangle.
  Range bounds(const Attributes (&corners)[3]) const {
    const Range covered = coverage_bounds(corners);
    return {covered.low * (1.0f - through_),
            through_texture_ ? covered.high : covered.high * (1.0f - through_)};
  }

 private:
  float coverage(const Attributes& a) const {
    if (mode_ == kOpaque) return 1.0f;
    const float factor = factor_ * a.color.w;
    return covered(texture_ ? factor * texture_.alpha(a.uv) : factor);
  }
  Range coverage_bounds(const Attributes (&corners)[3]) const {
    if (mode_ == kOpaque) return {1.0f, 1.0f};
    Range color{corners[0].color.w, corners[0].color.w};
    for (const Attributes& c : corners) {
      color.low = std::min(color.low, c.color.w);
      color.high = std::max(color.high, c.color.w);
    }
    Range texels = whole_;
    if (texture_) texels = texture_.alpha_range(corners[0].uv, corners[1].uv, corners[2].uv).value_or(whole_);
    // Factors are not negative. Allow a few units in the last place for the rounding of interpolation.
    constexpr float kSlack = 0x1p-20f;
    const float low = factor_ * color.low * texels.low, high = factor_ * color.high * texels.high;
    const bool exact = color.low == color.high && texels.low == texels.high;
    return {covered(exact ? low : low * (1.0f - kSlack)), covered(exact ? high : high * (1.0f + kSlack))};
  }
  float covered(float alpha) const {
    if (mode_ == kMask) return alpha >= cutoff_ ? 1.0f : 0.0f;
    return std::clamp(alpha, 0.0f, 1.0f);
  }

  enum Mode { kOpaque, kMask, kBlend } mode_ = kOpaque;
  float cutoff_ = 0.5f, factor_ = 1.0f;
  TextureSampler texture_;
  Range whole_{1.0f, 1.0f};  // of the texture
  float through_ = 0.0f;
  TextureSampler through_texture_;
};

}  // namespace kiln
