// Texels of which one part is hidden from the other or from the rest of the scene.
#pragma once

#include <optional>
#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/bake/neighbours/site_geometry.h"

namespace kiln {

// By site: 1 where the texel's points differ much in openness, the share of directions that are free for the
// length from which paths read a texel's mean: under the edge of a plate, behind a frame, under half a lamp.
// Paths from afar arrive at the open points, but the mean is over all: it includes the dark under the plate,
// or the glare under the lamp, which those paths do not meet. Also 1 where something stands between any of
// the points, so that they see two sides of it, or covers some of them: a closed cavity is lit by the corner
// of a texel that reaches out of it (straddling.h finds exactly what atlas.contacts knows of).
//
// 32 short rays a site if anything is within their length, and up to 127 more if it is near the surface.
// Texels that lie together on one face, with nothing near, are passed over at once. Returns nullopt if that
// would take more than `most_seconds`. Independent of the number of threads.
std::optional<std::vector<uint8_t>> half_hidden_sites(const Scene& scene, const Atlas& atlas,
                                                      const SiteGeometry& sites, unsigned threads,
                                                      double most_seconds);

}  // namespace kiln
