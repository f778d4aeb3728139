// What a place for a probe is found to be, by a fixed set of rays.
#pragma once

#include <optional>

#include "common/probes/volume.h"
#include "coordinator/scene/sight/scene_rays.h"
#include "coordinator/scene/sight/solid.h"

namespace kiln {

struct ProbePlace {
  Vec3 position{0.0f};
  ProbeState state = ProbeState::kActive;
  float validity = 1;        // share of directions that do not meet a back face
  std::optional<Vec3> exit;  // of an inactive one: a point in front of the nearest surface around it
};

// Where a probe of the grid goes. Inside geometry (more than kMostBacks of its rays meet back faces): behind
// the nearest surface that leads out, if that is within kMostMoved spacings along each axis, else it is
// inactive. Closer to a surface than a tenth of the spacing: away from it. (RTXGI's relocation and
// classification in one step; departure: the nearest few ways out are tried, and none is taken that leads
// back inside.)
constexpr float kMostBacks = 0.25f, kMostMoved = 0.45f;
ProbePlace place_probe(const SceneRays& rays, const Solid& solid, const Vec3& grid, float spacing);

}  // namespace kiln
