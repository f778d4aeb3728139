// The charts of one layout in another of the same scene.
//
// Charts have numbers of their own in a mesh, and instances in a scene; layouts of one density have the same
// ones. Where another density has cut an instance's charts elsewhere (cut_at_contacts), its charts are found
// by where their faces lie.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

constexpr uint32_t kNoChart = ~0u;

// By placement of `to`: the placement of `from` that all of it lies on; kNoChart: several, or places that had
// no texels. Of `to` no place need be known yet.
std::vector<uint32_t> same_charts(const Atlas& from, const Atlas& to);

// Charts by their reason as a text of numbers and ranges, and back: "0-5,9". Reading sets those of `charts`
// that are named; false: it is no such text, or names a chart that there is not.
std::string list_charts(const std::vector<uint8_t>& charts, CollapseReason reason);
bool read_charts(std::string_view list, CollapseReason reason, std::vector<uint8_t>& charts);

}  // namespace kiln
