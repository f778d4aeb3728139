// Reflections of lobes off rough surfaces, as renderers evaluate them; docs/shaders/kiln_bases.glsl is the
// same in GLSL. GGX with height-correlated Smith shadowing and Schlick's Fresnel term, one scattering; alpha
// is the square of the roughness.
#pragma once

#include <vector>

#include "common/responses/lobes.h"

namespace kiln {

// What the lobes of a texel say about light, RGB each; only the first `count` of the set count.
struct LobeTexel {
  Vec3 lobe[kMaxLobes];
};

// Radiance reflected towards `to_eye` at a place of shading normal n (the lobes' frame) whose bumps turn the
// normal to m; unit vectors in world axes, roughness in [0, 1], f0 the reflectance straight on. In the unit
// of the lobes, never negative; 0 where the eye is behind m.
//
// Ambient Dice: Roughton's fit (2019, section 8.4), B in the mirror direction blended with irradiance and
// scaled by DiceResponse. Over the directions of a lobe and cosines of the eye and alphas from 0.05 to 0.95,
// a white surface under one lobe is off by an rms of 0.015 and by 0.14 at most, where a lobe is 0.6 at its
// axis; under even light by 12 %, the mean over eyes. Spherical Gaussians: the distribution of microfacets as
// an anisotropic Gaussian about the mirror direction (Xu et al. 2013, Anisotropic Spherical Gaussians),
// convolved with each lobe; the other factors are those at the mirror direction. Over the same grid off by an
// rms of 0.050 and by 0.49 at most, where a lobe is 1 at its axis; 0.027 and 0.13 while the eye is within 60
// degrees of the normal.
Vec3 lobes_specular(const LobeSet& set, const LobeTexel& texel, const Vec3& n, const Vec3& m,
                    const Vec3& to_eye, float roughness, const Vec3& f0);

// By how much the fit for Ambient Dice is multiplied, by the cosine of the eye and alpha, each from 0 to 1 at
// even steps: what a lobe near the mirror direction reflects / what the fit says without this.
class DiceResponse {
 public:
  static constexpr int kSize = 32;
  struct Scale {
    float f0, f90;  // of the reflectance straight on, and at grazing angles
  };
  // Computed on first use: 2^10 visible normals an entry, in the same order everywhere.
  static const DiceResponse& get();
  // Bilinear; arguments outside [0, 1] are clamped.
  Scale operator()(float eye_cosine, float alpha) const;
  // Rows of rising alpha, in each of them rising cosines.
  const std::vector<Scale>& entries() const { return entries_; }

 private:
  DiceResponse();
  std::vector<Scale> entries_;
};

// The fit for Ambient Dice without DiceResponse, for a lobe at these cosines to the mirror direction and to
// the normal.
float dice_reflection(float mirror_cosine, float normal_cosine, float alpha);

}  // namespace kiln
