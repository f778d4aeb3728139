// The atlas: charts of all instances placed on pages, and which surface points each texel owns.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/figures.h"
#include "common/base/status.h"
#include "common/contacts/contacts.h"
#include "common/scene/scene.h"
#include "common/unwrap/charts.h"

namespace kiln {

// Texel coordinates of a chart's point: (turned ? uv.yx : uv) * scale + offset, on `page`. A chart turned by
// 90 degrees has one negative scale, so that it is not mirrored. Texel (x, y) covers [x, x+1) x [y, y+1); a
// bilinear lookup at texel coordinates c reads the texels whose centres surround c.
struct ChartPlacement {
  Vec2 scale{1.0f}, offset{0.0f};
  uint32_t page = 0;
  uint32_t turned = 0;  // 0 or 1

  DVec2 to_texels(const DVec2& uv) const {
    return (turned ? DVec2(uv.y, uv.x) : uv) * DVec2(scale) + DVec2(offset);
  }
};

// A face on its page. Everything that finds or evaluates sites gets corners from here, so the bits agree.
inline Triangle2 texel_triangle(const MeshCharts& charts, const ChartPlacement& place, size_t face) {
  Triangle2 t = uv_triangle(charts, face);
  for (DVec2& c : t.c) c = place.to_texels(c);
  return t;
}

// Surface points of the valid texels, in Morton order of world position. 64 candidate points a texel
// (Hammersley set, see site_point); a record says which lie on which (instance, face).
// Record: valid mask lo, hi; then per pair: cover lo, hi, instance, face. (Roughton 2019, 4.2.)
struct TexelSites {
  std::vector<uint32_t> texel;       // (page * height + y) * width + x
  std::vector<uint32_t> first_word;  // size texel.size() + 1
  std::vector<uint32_t> words;
  size_t size() const { return texel.size(); }
};

// Position of a chart in layout pack: the corner of its mask, in texels. `key`: hash of its number in the
// mesh, its size in steps and its mask.
struct PackedChart {
  uint64_t key = 0;
  uint32_t x = 0, y = 0, page = 0;
  uint32_t turned = 0;  // 0 or 1
};
struct PreviousLayout;

// Why a chart is collapsed to the minimum size (AtlasSettings::collapse).
enum CollapseReason : uint8_t {
  kNotCollapsed,
  kUnseen,     // no camera, light or opening reaches it
  kUnlit,      // a first pass found no light there
  kEvenlyLit,  // a first pass found it evenly lit
};
constexpr size_t kCollapseReasons = 4;

struct CollapsedCharts {
  uint64_t charts = 0;
  uint64_t texels = 0;  // of their masks
  uint64_t from = 0;    // texels they would have at full size
  uint64_t saved() const { return from - texels; }
};

// For the report.
struct AtlasStatistics {
  uint64_t charts = 0;                          // placed, over all instances
  uint64_t distinct_masks = 0;                  // layout pack: equal instances share one
  uint64_t mask_texels = 0;                     // texels in a chart's bilinear footprint
  uint64_t covered_texels = 0;                  // texels with a site
  uint64_t overlapped_points = 0;               // site points claimed twice; the first triangle owns them
  uint32_t generated_meshes = 0;                // meshes that were unwrapped
  float texels_per_metre = 0;                   // layout pack: the density used, for factor 1
  uint64_t kept_charts = 0;                     // layout pack: charts kept where the previous layout had them
  uint32_t cut_charts = 0;                      // charts added by cuts at contacts
  CollapsedCharts collapsed[kCollapseReasons];  // layout pack: collapsed, by CollapseReason
  std::vector<StageTime> steps;                 // time by step

  // Share of the texels that charts would have if none were collapsed.
  double share(uint64_t texels) const {
    uint64_t all = mask_texels;
    for (const CollapsedCharts& c : collapsed) all += c.saved();
    return all ? static_cast<double>(texels) / static_cast<double>(all) : 0.0;
  }
};

struct Atlas {
  uint32_t width = 0, height = 0, pages = 1;
  bool packed = false;                         // layout pack; else the file's own atlas
  std::vector<MeshCharts> charts;              // by mesh; then sets of instances with their own
  std::vector<uint32_t> charts_of_instance;    // index into charts
  std::vector<uint32_t> instance_first_chart;  // by instance, size + 1: index into placements
  std::vector<ChartPlacement> placements;      // by (instance, chart)
  std::vector<uint32_t> owner;                 // by texel: placement index + 1 whose bilinear footprint
                                               // holds it, 0: empty. Coordinator only: not sent.
  std::vector<PackedChart> packed_charts;      // layout pack: by placement. Coordinator only: not sent.
  std::vector<uint8_t> collapsed;  // by placement: a CollapseReason; empty: none. Coordinator only: not sent.
  TexelSites sites;
  std::vector<ContactLine> contacts;  // lines where surfaces stand on others. Coordinator only: not sent.
  std::vector<std::string> warnings;  // for the report, one sentence each: the user should act
  std::vector<std::string> notes;     // likewise: for information
  AtlasStatistics statistics;         // coordinator only: not sent

  const MeshCharts& of_instance(size_t instance) const { return charts[charts_of_instance[instance]]; }
  // Whether an instance has charts. False where Instance::receive is false, or without area in layout atlas.
  bool receives(size_t instance) const { return of_instance(instance).chart_count > 0; }
  uint64_t texel_count() const { return uint64_t{width} * height * pages; }
  // Packing efficiency: share of all texels that belong to a chart.
  double used_share() const {
    return texel_count() ? static_cast<double>(statistics.mask_texels) / static_cast<double>(texel_count())
                         : 0.0;
  }
};

// Charts cut for one density, before packing.
struct ChartsToSize {
  const Atlas& atlas;                // charts, charts_of_instance and instance_first_chart are there
  std::span<const double> texel;     // metres of a texel, by instance
  std::span<const uint64_t> texels;  // of the box, by placement: estimated size of a chart; at least 4
};

struct AtlasSettings {
  enum class Layout { kAuto, kAtlas, kPack } layout = Layout::kAuto;
  uint32_t width = 1024, height = 1024;  // layout atlas
  float texels_per_metre = 4.0f;         // layout pack
  std::vector<float> density;            // by instance, times texels_per_metre; empty: 1
  uint32_t max_page_size = 8192;         // layout pack: a side
  bool power_of_two = false;             // layout pack: both sides
  bool block_align = false;              // layout pack: no two charts in one 4x4 block
  uint32_t mip_levels = 0;    // layout pack: below the first; no bilinear lookup there mixes two charts
  uint64_t texel_budget = 0;  // layout pack: of all pages; lowers texels_per_metre; 0: none
  // layout pack: selects charts to collapse to 2 x 2 texels whatever the density: a CollapseReason by
  // placement; other charts are unaffected. Must not depend on the number of threads. Empty: none.
  std::function<std::vector<uint8_t>(const ChartsToSize&)> collapse;
  const PreviousLayout* previous = nullptr;  // layout pack: charts stay where they were (previous_layout.h)
  uint64_t max_texels = uint64_t{1} << 31;   // on all pages; more is an error that names what fits
  bool cut_contacts = true;                  // layout pack: charts end where a wall stands on them
  UnwrapChoice unwrap;                       // layout pack: which charts are generated, and how
  unsigned threads = 0;                      // 0: all; affects only run time
  // Called between steps and within long ones, from any thread; an error stops the layout with that error.
  // Empty: never called.
  std::function<Status()> may_go_on;

  Status check() const { return may_go_on ? may_go_on() : Status{}; }
};

// Builds charts, places them and finds the texel sites. The same scene and settings give the same atlas
// whatever the number of threads.
// Errors (kInvalidInput) name the objects: layout atlas without TEXCOORD_1, coordinates outside [0,1],
// two objects on one texel; a density at which the pages would not fit; no texel covered at all.
Expected<Atlas> build_atlas(const Scene& scene, const AtlasSettings& settings);

// Estimated texels that layout pack needs for the charts of an atlas at a density, with the settings it was
// built with; accurate enough for ratios.
double layout_texels(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings, double density);

// Point j of 64 in the unit square: Hammersley (j + 1/2)/64, radical inverse.
Vec2 site_point(uint32_t j);

// Point j of a texel's valid points that `u` in [0,1) picks (uniformly), as instance, triangle and
// barycentrics of vertices 1 and 2, computed in double and clamped into the triangle.
struct SitePick {
  uint32_t instance, triangle;
  float b1, b2;
};
SitePick pick_site(const Atlas& atlas, uint32_t site, float u);

// The part of the atlas that a worker needs, as one chunk.
Bytes write_atlas(const Atlas& atlas);
Expected<Atlas> read_atlas(std::span<const std::byte> bytes, const Scene& scene);  // checked; owner is empty

}  // namespace kiln
