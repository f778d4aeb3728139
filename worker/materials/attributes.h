#pragma once

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/scene/record_reader.h"
#include "common/scene/scene.h"
#include "worker/materials/texture_sampler.h"

namespace kiln {

// What a mesh interpolates to at a point, as far as materials ask for it.
struct Attributes {
  Vec2 uv[2] = {Vec2(0.0f), Vec2(0.0f)};
  Vec4 color{1.0f};
};

// What a material's emission is the product of, for whoever integrates it over a triangle.
struct EmissionParts {
  Vec3 factor;
  const TextureSampler* texture;  // null: none
  bool vertex_color;              // times Attributes::color
};

// The alpha behaviour that all materials share (glTF 2.0, 3.9.4).
struct AlphaMode {
  enum Mode { kOpaque, kMask, kBlend } mode = kOpaque;
  float cutoff = 0.5f;

  static AlphaMode parse(RecordReader& r) {
    AlphaMode a;
    const std::string word = r.word("alpha_mode", "opaque");
    a.mode = word == "mask" ? kMask : word == "blend" ? kBlend : kOpaque;
    a.cutoff = r.number("alpha_cutoff", 0.5f);
    return a;
  }
  float opacity(float alpha) const {
    if (mode == kOpaque) return 1.0f;
    if (mode == kMask) return alpha >= cutoff ? 1.0f : 0.0f;
    return std::clamp(alpha, 0.0f, 1.0f);
  }
};

}  // namespace kiln
