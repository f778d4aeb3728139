// ROOM: add a stage. Stages turn measured texels into a map that can be filtered; they see planes and
// classes; `fit` alone asks the basis. One file and one line in the roster.
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
  SeamFinder* seams = nullptr;  // seams of this atlas; null: found where needed
};

struct PostStage {
  std::string_view name;
  std::string_view about;
  // Figures about its work go into the report.
  Figures (*run)(Lightmap&, const PostContext&);
};

// In order of execution.
std::span<const PostStage> post_stages();

// Fills texels of a chart without a measurement (no site, or inside geometry) with the mean of their set 3x3
// neighbours on the same chart, ring by ring, until none can be filled. (O'Donnell 2018, "Correct bilinear
// interpolation"; departure: repeated, and never across the page to another chart.) A chart without any
// measured texel is filled from lookups across its seams, where the surface is continuous. Without seams, its
// texels keep their class, kEmpty or kInside, and become black; the figures count them.
Figures fill_invalid(Lightmap& map, const PostContext& context);

// Makes bilinear lookups on both sides of seams agree (coordinator/bake/seams), unless settings.seams is off.
// Runs before dilate, so that empty texels copy the matched values.
Figures join_seams(Lightmap& map, const PostContext& context);

// Applies the basis' finish() to every texel of a chart, with E as filled and joined, so that engines that
// evaluate the basis at the surface's normal show E. Texels outside charts copy the result (dilate). Nothing
// for bases without finish().
Figures fit_basis(Lightmap& map, const PostContext& context);

// Fills empty texels outside every chart's bilinear footprint (Atlas::owner 0) with the mean of their set 3x3
// neighbours on any chart, settings.dilate times. Texels of charts get values from `fill`, or none.
Figures dilate(Lightmap& map, const PostContext& context);

// Fills and dilates the responses by their own classes: what light's stages did to a texel says nothing of
// them.
void complete_responses(Lightmap& map, const PostContext& context);

}  // namespace kiln
