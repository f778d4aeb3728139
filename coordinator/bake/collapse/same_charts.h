// Matches the charts of two layouts of the same scene.
//
// Charts are numbered within a mesh and instances within a scene; layouts of one density agree on both. Where
// another density cut an instance's charts elsewhere (cut_at_contacts), charts are matched by the position of
// their faces.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

constexpr uint32_t kNoChart = ~0u;

// By placement of `to`: the placement of `from` that contains all of it; kNoChart: several, or surface that
// had no texels. `to` need not be packed yet.
std::vector<uint32_t> same_charts(const Atlas& from, const Atlas& to);

// Writes the charts with a given reason as numbers and ranges, such as "0-5,9", and reads them back. Reading
// sets the named entries of `charts`; returns false if the text is malformed or names a chart that does not
// exist.
std::string list_charts(const std::vector<uint8_t>& charts, CollapseReason reason);
bool read_charts(std::string_view list, CollapseReason reason, std::vector<uint8_t>& charts);

}  // namespace kiln
