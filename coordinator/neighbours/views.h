// What texel sites see: whether light that falls on one says anything about the one beside it.
#pragma once

#include <optional>

#include "coordinator/neighbours/surface_links.h"

namespace kiln {

// Takes away links between sites that see something else in most directions: one is inside a cupboard, under a tread or
// behind a panel, the other is not, with no line of contact between them. A fixed set of directions is asked
// for the first surface from each site; no random numbers, so that the edge is as sharp as the geometry.
// Links that go on are as they were. Returns how many were taken away; nothing, and all links stay, where it
// would take more than `most_seconds`. Some four rays a site. The same for any number of threads.
std::optional<size_t> part_by_view(const Scene& scene, const SiteGeometry& sites, unsigned threads,
                                   double most_seconds, SurfaceLinks& links);

}  // namespace kiln
