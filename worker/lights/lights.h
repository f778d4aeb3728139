// All lights of the scene in three strategies: far discs, the environment, and what is inside. A new light
// inside is one pair of files and its place in the roster (light_roster.h).
#pragma once

#include "worker/lights/directional.h"
#include "worker/lights/environment.h"
#include "worker/lights/local_lights.h"

namespace kiln {

struct Lights {
  DirectionalLights directional;
  Environment environment;
  LocalLights local;

  // Parses the light records of the scene and finds its emissive triangles. Unknown types fail.
  static Expected<Lights> create(const Surfaces& surfaces, std::vector<std::string>& warnings,
                                 LightChoice choice = LightChoice::kTree);
};

}  // namespace kiln
