// Compares the views of neighbouring texel sites: whether light on one predicts light on the other.
#pragma once

#include <optional>

#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

struct ViewLinks {
  size_t parted = 0, added = 0;
};

// Removes links between sites that see different surfaces in most directions: one is inside a cupboard, under
// a tread or behind a panel and the other is not, without a contact line between them. Adds links between
// sites of small pieces (slats, books, leaves) that are adjacent, coplanar, face the same way and see the
// same. Traces a fixed set of directions from each site, without random numbers, so edges are as sharp as the
// geometry. Returns nullopt, and keeps all links, if it would take more than `most_seconds`. About four rays
// a site. Independent of the number of threads.
std::optional<ViewLinks> link_by_view(const Scene& scene, const SiteGeometry& sites, unsigned threads,
                                      double most_seconds, SurfaceLinks& links);

}  // namespace kiln
