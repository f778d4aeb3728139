// Random light over a surface, for tests of bases.
#pragma once

#include <random>
#include <vector>

#include "common/math/frame.h"

namespace kiln::test {

// Light from directions of the hemisphere about n: an ambient part with a gradient, and discs.
struct Light {
  struct Source {
    Vec3 direction;
    double irradiance;  // at normal incidence
  };
  std::vector<Source> sources;
  double irradiance(const Vec3& m) const {
    double e = 0;
    for (const Source& s : sources) e += s.irradiance * std::max(0.0, double{dot(s.direction, m)});
    return e;
  }
};

inline Vec3 on_cap(double u, double v, double low) {
  const double z = 1 - u * (1 - low), r = std::sqrt(1 - z * z), phi = 2 * M_PI * v;
  return Vec3(r * std::cos(phi), r * std::sin(phi), z);
}

inline Light random_light(std::mt19937& random, const Vec3& n) {
  std::uniform_real_distribution<double> u(0, 1);
  const Frame frame(n);
  Light light;
  const Vec3 up = on_cap(u(random), u(random), -1);
  const double slope = u(random);
  constexpr int kAmbient = 400;
  for (int i = 0; i < kAmbient; ++i) {
    const Vec3 d = on_cap((i + 0.5) / kAmbient, 0.61803398875 * i, 0);
    light.sources.push_back({frame.to_world(d), (1 + slope * dot(d, up)) * 2 * M_PI / kAmbient});
  }
  for (int discs = 1 + static_cast<int>(3 * u(random)); discs > 0; --discs) {
    const Vec3 axis = on_cap(u(random), u(random), 0.05);
    const double radius = (3 + 27 * u(random)) * M_PI / 180, total = 20 * u(random) * u(random);
    const Frame disc(axis);
    for (int i = 0; i < 40; ++i) {
      const Vec3 d = disc.to_world(on_cap((i + 0.5) / 40, 0.61803398875 * i, std::cos(radius)));
      if (d.z > 0) light.sources.push_back({frame.to_world(d), total / 40});
    }
  }
  return light;
}

}  // namespace kiln::test
