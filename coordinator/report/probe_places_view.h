// Where the probes of a plan are: the scene from above and from the side.
#pragma once

#include "coordinator/picture/picture.h"
#include "coordinator/scene/probes/probes.h"

namespace kiln {

// Two parallel projections of one scale, the top view (x to the right, z down) above the side view (x to the
// right, y up): edges of the geometry in grey, outlines of the finest bricks at each place by level, probes
// by state. Probes that lie behind each other share a dot, whose colour is the mean.
Picture probe_places_picture(const Scene& scene, const ProbeLayout& layout);

}  // namespace kiln
