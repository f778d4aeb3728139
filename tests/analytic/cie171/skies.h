// The skies of CIE S 011 (ISO 15469), relative to their zenith.
#pragma once

#include "tests/analytic/scene_maker.h"

namespace kiln::test {

constexpr int kSkyTypes = 16;  // 1 to 15: the general sky; 16: the traditional overcast sky

// Radiance of a direction above the horizon (+y is the zenith) over that of the zenith; `sun` is a unit
// vector.
double sky_radiance(int type, const DVec3& direction, const DVec3& sun);

// An equirectangular image of the sky; `below` is the radiance of all directions below the horizon.
void add_sky(SceneMaker& maker, int type, const DVec3& sun, double below);

}  // namespace kiln::test
