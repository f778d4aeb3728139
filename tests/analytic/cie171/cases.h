// Scenes in the spirit of the analytical cases of CIE 171:2006 (section 5), each with a closed form or a
// quadrature of our own. The table of docs/cie171.md has one row per case.
#pragma once

#include <functional>

#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {

// Mean irradiance over one receiver (or a flux, where the case says so), in consistent units.
struct Outcome {
  double expected = 0, measured = 0;
  double error = 0;   // standard error of `measured`, its samples taken as independent
  double within = 0;  // share of texels within three standard errors of their own truth
};
struct CieCase {
  std::string section;  // of CIE 171:2006
  std::string name;     // unique
  std::string form;     // where the expected value comes from
  std::function<Outcome()> run;
};

void add_lamp_cases(std::vector<CieCase>& cases);        // 5.2 to 5.4
void add_glass_cases(std::vector<CieCase>& cases);       // 5.5
void add_reflection_cases(std::vector<CieCase>& cases);  // 5.6 to 5.8
void add_roof_cases(std::vector<CieCase>& cases);        // 5.9, 5.10
void add_facade_cases(std::vector<CieCase>& cases);      // 5.11 to 5.14
const std::vector<CieCase>& all_cie_cases();

using Irradiance = std::function<double(const Vec3& point, const Vec3& normal)>;

// Leaves texels on these instances alone.
void receive_only(Scene& scene, std::initializer_list<uint32_t> instances);
// Compares an instance with its irradiance at every point, weighted by the texels' coverage.
Outcome compare_with(const Bake& bake, uint32_t instance, const Irradiance& truth);

// Lambert 1760: irradiance at p with normal n from a polygon of radiance 1 that is wholly above the horizon
// of p.
double from_polygon(const Vec3& p, const Vec3& n, const std::vector<DVec3>& polygon);

// Gauss-Legendre rules on [low, high], halved until both halves agree with the whole to 1e-6.
double integrate(double low, double high, const std::function<double(double)>& f);

}  // namespace kiln::test
