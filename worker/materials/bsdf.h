// The closure every material yields at a point: a Lambert layer under a GGX layer, and emission.
#pragma once

#include "common/math/frame.h"
#include "common/math/warp.h"

namespace kiln {

struct Bsdf {
  Vec3 diffuse{0.0f};   // albedo of the Lambert layer
  Vec3 f0{0.0f};        // reflectance of the GGX layer at normal incidence; 0: no such layer
  float alpha = 1.0f;   // GGX width, roughness squared
  Vec3 emission{0.0f};  // radiance, nit

  bool has_specular() const { return max_component(f0) > 0.0f; }
  bool has_diffuse() const { return max_component(diffuse) > 0.0f; }
};

struct BsdfSample {
  Vec3 direction;      // local; z along the shading normal
  Vec3 weight{0.0f};   // f cos / pdf; zero: the path ends
  float pdf = 0.0f;    // per steradian, of all layers together
};

// Directions are local, unit and leave the surface; wo is towards where the light goes.
Vec3 evaluate(const Bsdf& b, const Vec3& wo, const Vec3& wi);  // f, without the cosine
float pdf(const Bsdf& b, const Vec3& wo, const Vec3& wi);
BsdfSample sample(const Bsdf& b, const Vec3& wo, float u_layer, const Vec2& u);

}  // namespace kiln
