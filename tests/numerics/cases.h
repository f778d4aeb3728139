// The table of docs/numerics.md: what stiff and extreme input does to the numbers.
#pragma once

#include <functional>

#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {

struct Measured {
  double expected = 0, measured = 0;
  double error = 0;  // stated: how far apart they may be
};
struct Case {
  std::string name;   // one row; a name of its own
  std::string about;  // what is measured, and what the error is made of
  std::function<Measured()> run;
  bool fails = false;  // known to, for the reason that `about` gives
};

void add_scale_cases(std::vector<Case>& cases);
void add_light_cases(std::vector<Case>& cases);
void add_geometry_cases(std::vector<Case>& cases);
void add_sum_cases(std::vector<Case>& cases);
const std::vector<Case>& all_cases();

// Mean over texels, weighted by the share of each that is surface, with its standard error.
struct MeanE {
  double value = 0, error = 0;
};
MeanE mean_e(const Bake& bake, std::optional<uint32_t> instance = std::nullopt);
// Mean E of an instance against a truth. Error: four standard errors, and 2^-18 for the rounding of floats.
Measured against(const MeanE& mean, double truth);
// The same where the truth differs from texel to texel: the ratio to it, expected to be 1.
Measured ratio_to(const Bake& bake, uint32_t instance,
                  const std::function<double(const Vec3&, const Vec3&)>& f);

// Lambert 1760: irradiance at p with normal n from a polygon of radiance 1, all of it above the horizon.
double polygon_irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& polygon);

}  // namespace kiln::test
