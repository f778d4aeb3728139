// What texel sites see: whether light that falls on one says anything about the one beside it.
#pragma once

#include <optional>

#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

struct ViewLinks {
  size_t parted = 0, added = 0;
};

// Takes away links between sites that see something else in most directions: one is inside a cupboard, under
// a tread or behind a panel, the other is not, with no line of contact between them. And links sites of
// pieces of few texels (slats, books, leaves) with those of other such pieces beside them that face the same
// way, in one plane, and see the same. A fixed set of directions is asked for the first surface from each
// site; no random numbers, so that edges are as sharp as the geometry. Nothing, and all links stay, where it
// would take more than `most_seconds`. Some four rays a site. The same for any number of threads.
std::optional<ViewLinks> link_by_view(const Scene& scene, const SiteGeometry& sites, unsigned threads,
                                      double most_seconds, SurfaceLinks& links);

}  // namespace kiln
