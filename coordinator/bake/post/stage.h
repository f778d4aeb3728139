// ROOM: add a stage. Stages turn measured texels into a map that can be filtered; they see planes and
// classes, never a basis. One file and one line in the roster.
#pragma once

#include <span>
#include <string_view>

#include "common/atlas/atlas.h"
#include "common/base/figures.h"
#include "common/job/settings.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {

struct PostContext {
  const Scene& scene;
  const Atlas& atlas;
  const BakeSettings& settings;
  SeamFinder* seams = nullptr;  // of these; null: looked for where they are needed
};

struct PostStage {
  std::string_view name;
  std::string_view about;
  // What it has to say of its work goes into the report.
  Figures (*run)(Lightmap&, const PostContext&);
};

// In the order of running.
std::span<const PostStage> post_stages();

// Texels of a chart without a measurement (no site, or inside geometry) take the mean of their set 3x3
// neighbours of the same chart, ring by ring, until none can be filled. (O'Donnell 2018, "Correct bilinear
// interpolation"; departure: repeated, and never across the page to another chart.) A chart without any
// measured texel takes what lookups across its seams give, where the surface goes on. Where it does not, its
// texels stay as they were classed, kEmpty or kInside, and become black; the figures count them.
Figures fill_invalid(Lightmap& map, const PostContext& context);

// Bilinear lookups on both sides of seams are made to agree (coordinator/bake/seams), unless settings.seams
// is off. Before dilate, so that empty texels take joined values.
Figures join_seams(Lightmap& map, const PostContext& context);

// Empty texels outside the bilinear footprint of every chart (Atlas::owner 0) take the mean of their set 3x3
// neighbours of any chart, settings.dilate times. Texels of charts have their values from `fill`, or none.
Figures dilate(Lightmap& map, const PostContext& context);

}  // namespace kiln
