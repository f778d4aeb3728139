// All lights of the scene in three strategies: distant discs, the environment, and local lights. A
// new local light is one pair of files and an entry in the roster (light_roster.h).
#pragma once

#include "worker/lights/directional.h"
#include "worker/lights/environment.h"
#include "worker/lights/local_lights.h"

namespace kiln {

struct Lights {
  DirectionalLights directional;
  Environment environment;
  LocalLights local;

  // Parses the scene's light records and collects emissive triangles. Unknown types fail.
  static Expected<Lights> create(const Surfaces& surfaces, std::vector<std::string>& warnings,
                                 LightChoice choice = LightChoice::kTree);
};

}  // namespace kiln
