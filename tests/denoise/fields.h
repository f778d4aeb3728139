// Surfaces of made scenes, and known fields on them with noise.
#pragma once

#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "coordinator/bake/denoise/denoise.h"
#include "tests/denoise/scenes.h"
#include "tests/seams/pieces.h"

namespace kiln::test {

inline const DirectionBound kBounds[3] = {{3, {6, 9, 12}}, {4, {7, 10, 13}}, {5, {8, 11, 14}}};

struct MadeSurface {
  Scene scene;
  Atlas atlas;
  SiteGeometry sites;
  SurfaceLinks links;
  MadeSurface(const Scene& s, float density)
      : scene(s),
        atlas(packed(s, density)),
        sites(site_geometry(s, atlas, 2)),
        links(surface_links(s, atlas, sites, 2)) {}
  Denoised denoise(const TexelStatistics& s, unsigned threads = 2) const {
    return kiln::denoise(s, kBounds, sites, links, threads);
  }
};

using Field = std::function<double(const Vec3&)>;

// A known field with noise of a given standard deviation in the mean of both replicates. Planes: colours of E
// are 1, 1/2 and 1/4 of it, L0 a fourth of E, L1 an eighth along x; all with the same noise, relative.
inline TexelStatistics noisy(const SiteGeometry& sites, const Field& field, const Field& deviation,
                             uint64_t seed) {
  TexelStatistics s;
  s.sites = sites.size();
  s.planes = 15;
  s.samples.assign(s.sites, 32);
  s.known.assign(s.sites, 1);
  s.variance.resize(s.sites);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    s.mean[r].assign(s.sites * s.planes, 0);
    s.luminance[r].resize(s.sites);
    for (size_t i = 0; i < s.sites; ++i) {
      const double sigma = deviation(sites.position[i]);
      const double e = field(sites.position[i]) + std::sqrt(2.0) * sigma * normal(random);
      float* plane = &s.mean[r][i * s.planes];
      for (int c = 0; c < 3; ++c) {
        plane[c] = static_cast<float>(std::ldexp(e, -c));
        plane[3 + c] = plane[c] / 4;
        plane[6 + c] = plane[c] / 8;
      }
      s.luminance[r][i] = luminance(Vec3(plane[0], plane[1], plane[2]));
      const double share = luminance(Vec3(1, 0.5f, 0.25f));
      s.variance[i] = static_cast<float>(64 * sigma * sigma * share * share);
    }
  }
  return s;
}

inline const double kShare = luminance(Vec3(1, 0.5f, 0.25f));

struct Squares {
  double raw = 0, denoised = 0, ratio = 0, sites = 0;
};
inline Squares squares(const SiteGeometry& sites, const TexelStatistics& s, const Denoised& d,
                       const Field& field) {
  Squares q;
  for (size_t i = 0; i < s.sites; ++i) {
    const double t = field(sites.position[i]) * kShare;
    const double raw = (double{s.luminance[0][i]} + s.luminance[1][i]) / 2 - t, after = d.luminance[i] - t;
    q.raw += raw * raw;
    q.denoised += after * after;
    q.ratio += after * after / (double{d.standard_error[i]} * d.standard_error[i]);
    q.sites += 1;
  }
  return q;
}

inline const Field kNone = [](const Vec3&) { return 0.0; };
inline Field constant(double v) {
  return [v](const Vec3&) { return v; };
}

inline double sum_of(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}
inline double sum_of_measured(const TexelStatistics& s) {
  return 0.5 * (sum_of(s.luminance[0]) + sum_of(s.luminance[1]));
}

}  // namespace kiln::test
