// Reflection by GGX (height-correlated Smith, one scattering) as a weighted sum over directions of light, for
// tests: microfacets are drawn by their distribution, not by what the eye sees of them.
#pragma once

#include <cmath>
#include <vector>

#include "common/math/vec.h"

namespace kiln::test {

inline double smith_lambda(double cosine, double alpha) {
  return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - cosine * cosine) / (cosine * cosine)) - 1);
}

// For the normal z and an eye in the plane y = 0: radiance towards the eye is the sum of weight x (f0 (1 -
// grazing)
// + grazing) x the radiance from that direction.
struct GgxReference {
  struct Sample {
    Vec3 direction;
    double weight, grazing;
  };
  Vec3 eye;
  std::vector<Sample> samples;

  GgxReference(double eye_cosine, double alpha, int count) {
    const DVec3 v(std::sqrt(1 - eye_cosine * eye_cosine), 0, eye_cosine);
    eye = Vec3(v);
    for (int i = 0; i < count; ++i) {
      // D(h) (n.h) dh is even over u; dl = 4 (v.h) dh.
      const double u = (i + 0.5) / count, phi = 2 * M_PI * std::fmod(0.61803398874989485 * i, 1.0);
      const double z = std::sqrt((1 - u) / (1 + (alpha * alpha - 1) * u)), r = std::sqrt(1 - z * z);
      const DVec3 h(r * std::cos(phi), r * std::sin(phi), z);
      const double vh = dot(v, h);
      const DVec3 light = h * (2 * vh) - v;
      if (vh <= 0 || light.z <= 0) continue;
      const double g2 = 1 / (1 + smith_lambda(eye_cosine, alpha) + smith_lambda(light.z, alpha));
      samples.push_back({Vec3(light), g2 * vh / (eye_cosine * z) / count, std::pow(1 - vh, 5)});
    }
  }
};

}  // namespace kiln::test
