// ROOM: add a stage. Stages turn measured texels into a map that can be filtered; they see planes and
// classes, never a basis. One file and one line in the roster.
#pragma once

#include <span>
#include <string_view>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "coordinator/lightmap/lightmap.h"

namespace kiln {

struct PostStage {
  std::string_view name;
  std::string_view about;
  void (*run)(Lightmap&, const Atlas&, const BakeSettings&);
};

// In the order of running.
std::span<const PostStage> post_stages();

// Texels of a chart without a measurement (no site, or inside geometry) take the mean of their set 3x3
// neighbours of the same chart, ring by ring, until none can be filled. (O'Donnell 2018, "Correct bilinear
// interpolation"; departure: repeated, and never across charts.)
void fill_invalid(Lightmap& map, const Atlas& atlas, const BakeSettings& settings);

// Empty texels take the mean of their set 3x3 neighbours of any chart, settings.dilate times.
void dilate(Lightmap& map, const Atlas& atlas, const BakeSettings& settings);

}  // namespace kiln
