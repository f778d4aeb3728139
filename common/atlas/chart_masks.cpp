#include "common/atlas/chart_masks.h"

#include "common/base/check.h"
#include "common/base/hash.h"
#include "common/base/parallel.h"
#include "common/raster/footprint.h"

namespace kiln {
namespace {

using Key = ChartMasks::Key;

void find_distinct(const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps, ChartMasks& masks) {
  std::vector<std::pair<Key, uint32_t>> all(sizes.size());
  for (uint32_t p = 0; p < sizes.size(); ++p) all[p] = {{sizes[p].charts, sizes[p].chart, steps[p]}, p};
  std::sort(all.begin(), all.end());
  masks.of_placement.resize(sizes.size());
  for (const auto& [key, placement] : all) {
    if (masks.keys.empty() || masks.keys.back() != key) masks.keys.push_back(key);
    masks.of_placement[placement] = static_cast<uint32_t>(masks.keys.size() - 1);
  }
}

// The chart in its own mask, upright or turned: the first centres of its box lie `margin` texels and a half
// from the mask's corner. `at` is the corner on the page, `height` the upright mask's in texels. In double
// until the end: one rounding.
ChartPlacement placement_at(const ChartBox& box, const Steps& steps, uint32_t margin, uint32_t height,
                            const PackPlace& at) {
  const auto scale_of = [&](int axis) {
    const double extent = box.extent[axis];
    const double scale = extent > 0 ? (axis == 0 ? steps.x : steps.y) / extent : 1.0;
    return static_cast<float>(std::isfinite(static_cast<float>(scale)) ? scale : 1.0);
  };
  const float sx = scale_of(0), sy = scale_of(1);
  const double x = margin + 0.5 - box.low.x * double{sx}, y = margin + 0.5 - box.low.y * double{sy};
  ChartPlacement place;
  place.page = at.page;
  place.turned = at.turned;
  if (at.turned) {  // (x, y) -> (height - y, x)
    place.scale = Vec2(-sy, sx);
    place.offset = Vec2(DVec2(at.x + (height - y), at.y + x));
  } else {
    place.scale = Vec2(sx, sy);
    place.offset = Vec2(DVec2(at.x + x, at.y + y));
  }
  return place;
}

// `rules.mip_cell` texels a bit, or one.
BitImage rasterise(const MeshCharts& charts, std::span<const uint32_t> triangles, const ChartBox& box,
                   const Steps& steps, uint32_t margin, uint32_t cell) {
  const auto bits = [&](uint32_t s) {  // up to the last bit that a lookup at the box's high side reads
    return cell == 1 ? s + 1
                     : static_cast<uint32_t>(std::ceil((margin + 0.5 + s) / cell + 0.5 - kFootprintShrink));
  };
  BitImage mask(bits(steps.x), bits(steps.y));
  const ChartPlacement place = placement_at(box, steps, margin, 0, {0, 0, 0});
  for (uint32_t t : triangles) {
    Triangle2 triangle = texel_triangle(charts, place, t);
    for (DVec2& c : triangle.c) c /= cell;
    for_each_footprint_span(triangle, mask.width(), mask.height(),
                            [&](uint32_t y, uint32_t x0, uint32_t x1) { mask.set_span(y, x0, x1); });
  }
  return mask;
}

struct Chunk {
  MaskSet texels, cells;
};

void add_masks(const Atlas& atlas, const MeshChartBoxes& mesh, const Key& key, const PackRules& rules,
               Chunk& chunk) {
  const MeshCharts& charts = atlas.charts[key.charts];
  const auto bits = [&](uint32_t margin, uint32_t cell) {
    return rasterise(charts, mesh.triangles.of(key.chart), mesh.boxes[key.chart], key.steps, margin, cell);
  };
  chunk.texels.add(bits(0, 1));
  if (rules.cell == 1) return;
  if (rules.mip_cell == 1) {
    chunk.cells.add_reduced(chunk.texels[chunk.texels.size() - 1], rules.cell);
    return;
  }
  MaskSet mip;
  mip.add(bits(rules.margin(), rules.mip_cell));
  chunk.cells.add_reduced(mip[0], rules.cell / rules.mip_cell);
}

uint64_t shape_hash(const Key& key, const MaskView& mask, const PackRules& rules) {
  std::vector<uint64_t> data = {key.chart, key.steps.x, key.steps.y, rules.mip_cell};
  data.insert(data.end(), mask.words, mask.words + size_t{mask.words_per_row()} * mask.height);
  return xxh3(std::as_bytes(std::span(data)));
}

}  // namespace

ChartMasks chart_masks(const Atlas& atlas, const std::vector<MeshChartBoxes>& boxes,
                       const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps,
                       const PackRules& rules, unsigned threads) {
  ChartMasks masks;
  find_distinct(sizes, steps, masks);
  constexpr size_t kChunk = 256;
  std::vector<Chunk> chunks((masks.keys.size() + kChunk - 1) / kChunk);
  parallel_for(
      chunks.size(),
      [&](size_t c) {
        for (size_t k = c * kChunk; k < std::min(masks.keys.size(), (c + 1) * kChunk); ++k)
          add_masks(atlas, boxes[masks.keys[k].charts], masks.keys[k], rules, chunks[c]);
      },
      threads);
  for (MaskSet Chunk::*part : {&Chunk::texels, &Chunk::cells}) {
    MaskSet& all = part == &Chunk::texels ? masks.texels : masks.cells;
    size_t count = 0, words = 0;
    for (const Chunk& chunk : chunks) {
      count += (chunk.*part).size();
      words += (chunk.*part).word_count();
    }
    all.reserve(count, words);
    for (Chunk& chunk : chunks) {
      all.append(chunk.*part);
      chunk.*part = {};
    }
  }
  return masks;
}

std::vector<uint64_t> chart_keys(const ChartMasks& masks, const PackRules& rules) {
  std::vector<uint64_t> shapes(masks.keys.size()), keys(masks.of_placement.size());
  for (uint32_t k = 0; k < shapes.size(); ++k) shapes[k] = shape_hash(masks.keys[k], masks.texels[k], rules);
  for (size_t p = 0; p < keys.size(); ++p) keys[p] = shapes[masks.of_placement[p]];
  return keys;
}

void apply_packing(const PackResult& packed, const ChartMasks& masks,
                   const std::vector<MeshChartBoxes>& boxes, const PackRules& rules, Atlas& atlas) {
  atlas.width = packed.width;
  atlas.height = packed.height;
  atlas.pages = packed.pages;
  atlas.owner.assign(atlas.texel_count(), 0);
  atlas.packed_charts.resize(atlas.placements.size());
  atlas.statistics.mask_texels = 0;
  atlas.statistics.distinct_masks = masks.keys.size();
  const std::vector<uint64_t> keys = chart_keys(masks, rules);
  const uint32_t margin = rules.margin();
  for (uint32_t p = 0; p < atlas.placements.size(); ++p) {
    const uint32_t m = masks.of_placement[p];
    const Key& key = masks.keys[m];
    const PackPlace& at = packed.places[p];
    const uint32_t height = masks.packed()[m].height * rules.cell;
    atlas.placements[p] = placement_at(boxes[key.charts].boxes[key.chart], key.steps, margin, height, at);
    atlas.packed_charts[p] = {keys[p], at.x, at.y, at.page, at.turned};
    for_each_bit(masks.texels[m], [&](uint32_t bx, uint32_t by) {
      const uint32_t x = bx + margin, y = by + margin;
      const uint32_t px = at.x + (at.turned ? turned_x(height, y) : x), py = at.y + (at.turned ? x : y);
      uint32_t& owner = atlas.owner[(size_t{at.page} * atlas.height + py) * atlas.width + px];
      KILN_CHECK(owner == 0);
      owner = p + 1;
      ++atlas.statistics.mask_texels;
    });
  }
}

}  // namespace kiln
