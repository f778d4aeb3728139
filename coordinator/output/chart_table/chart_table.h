// The chart table of layout pack: where the charts of every instance are on the lightmap's pages. Published
// for engines that keep instancing (charts.json, charts.bin; docs/engines.md), and read back to keep a
// layout.
#pragma once

#include <filesystem>

#include "common/atlas/previous_layout.h"
#include "common/base/hash.h"

namespace kiln {

// Maps a point of a chart to lightmap coordinates: (turned ? uv.yx : uv) * scale + offset. uv is relative to
// the chart's box: (0, 0) at its smallest corner in the mesh's own coordinates, (1, 1) at its largest. The
// page is [0, 1]^2, v downwards. One element of the GPU buffer, in the layout of std430 and HLSL.
struct ChartTransform {
  Vec2 scale, offset;
  uint32_t page, turned;  // turned: 0 or 1
};
static_assert(sizeof(ChartTransform) == 24);

// A chart's box in the coordinates of MeshCharts::corner_uv.
struct ChartBounds {
  DVec2 low, high;
  Vec2 to_box(const Vec2& uv) const;  // to [0, 1]^2; 0 along a side without extent
};
std::vector<ChartBounds> chart_bounds(const MeshCharts& charts);  // by chart

// Indexed by placement: Atlas::instance_first_chart + chart.
std::vector<ChartTransform> chart_transforms(const Atlas& atlas);

// Text of charts.json and bytes of charts.bin, as described in docs/engines.md. Floats in the JSON
// are the shortest decimals that read back as the same float.
std::string charts_json(const Scene& scene, const Atlas& atlas);
Bytes charts_binary(const Atlas& atlas);

// Alignment of blocks in charts.bin: the largest minStorageBufferOffsetAlignment that Vulkan allows.
constexpr size_t kTableAlignment = 256;

struct KeptLayout {
  PreviousLayout layout;
  Digest digest;  // SHA-256 of the file
};
// The layout in a charts.json. Errors (kInvalidInput) name the file and the field.
Expected<KeptLayout> read_layout(const std::filesystem::path& charts_json);

}  // namespace kiln
