// Clear glass of index 1.5 without absorption, as a material and as formulas.
#pragma once

#include "tests/analytic/scene_maker.h"

namespace kiln::test {

// Adds the material and returns its index; a pane is a box of it.
uint32_t add_clear_glass(SceneMaker& maker);

// Transmittance of a pane, two surfaces without reflections between them, at a cosine to its normal:
// (1 - F)^2 with Schlick's F, as glTF's material states it.
double through_pane(double cos);
// The same of an ideal pane: Fresnel's equations for unpolarised light, with all reflections inside.
double through_fresnel_pane(double cos);

}  // namespace kiln::test
