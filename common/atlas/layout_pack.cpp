// Charts at their size in the world, laid on texel centres and packed. (O'Donnell 2018, chart masks and
// atlas packing; Roughton 2019, 4.1.)
#include "common/atlas/chart_size.h"
#include "common/atlas/layout.h"
#include "common/atlas/sites.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/pack/pack.h"
#include "common/raster/footprint.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxPages = 64;

// What a mask depends on: the border lies on centres, so steps and chart fix scale and phase.
struct MaskKey {
  uint32_t charts, chart;
  Steps steps;
  auto operator<=>(const MaskKey&) const = default;
};

// Distinct masks and which one each placement uses.
struct Masks {
  std::vector<MaskKey> keys;
  std::vector<BitImage> images;
  std::vector<uint32_t> of_placement;
};

Masks distinct_masks(const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps) {
  Masks masks;
  std::vector<std::pair<MaskKey, uint32_t>> all(sizes.size());
  for (uint32_t p = 0; p < sizes.size(); ++p) all[p] = {{sizes[p].charts, sizes[p].chart, steps[p]}, p};
  std::sort(all.begin(), all.end());
  masks.of_placement.resize(sizes.size());
  for (const auto& [key, placement] : all) {
    if (masks.keys.empty() || masks.keys.back() != key) masks.keys.push_back(key);
    masks.of_placement[placement] = static_cast<uint32_t>(masks.keys.size() - 1);
  }
  return masks;
}

// Scale and offset that lay the chart's box on the centres of texels (0, 0) and (steps.x, steps.y).
ChartPlacement on_centres(const ChartBox& box, const Steps& steps) {
  ChartPlacement place;
  for (int axis = 0; axis < 2; ++axis) {
    const double extent = box.extent[axis];
    place.scale[axis] = extent > 0 ? static_cast<float>((axis == 0 ? steps.x : steps.y) / extent) : 1.0f;
    if (!std::isfinite(place.scale[axis])) place.scale[axis] = 1.0f;
    place.offset[axis] = static_cast<float>(0.5 - box.low[axis] * double{place.scale[axis]});
  }
  return place;
}

BitImage make_mask(const MeshCharts& charts, std::span<const uint32_t> triangles, const ChartBox& box,
                   const Steps& steps) {
  BitImage mask(steps.x + 1, steps.y + 1);
  const ChartPlacement place = on_centres(box, steps);
  for (uint32_t t : triangles)
    for_each_footprint_span(texel_triangle(charts, place, t), mask.width(), mask.height(),
                            [&](uint32_t y, uint32_t x0, uint32_t x1) { mask.set_span(y, x0, x1); });
  return mask;
}

void make_masks(const Atlas& atlas, const std::vector<MeshChartBoxes>& boxes, Masks& masks,
                unsigned threads) {
  masks.images.resize(masks.keys.size());
  constexpr size_t kChunk = 64;
  parallel_for((masks.keys.size() + kChunk - 1) / kChunk,
               [&](size_t chunk) {
                 for (size_t k = chunk * kChunk; k < std::min(masks.keys.size(), (chunk + 1) * kChunk); ++k) {
                   const MaskKey& key = masks.keys[k];
                   const MeshChartBoxes& mesh = boxes[key.charts];
                   masks.images[k] = make_mask(atlas.charts[key.charts], mesh.triangles.of(key.chart),
                                               mesh.boxes[key.chart], key.steps);
                 }
               },
               threads);
}

// Three digits, downwards: a number that a person can type and that fits.
std::string round_down(double density) {
  const double unit = std::pow(10.0, std::floor(std::log10(density)) - 2);
  return text("{:.6g}", std::floor(density / unit) * unit);
}

tl::unexpected<Error> too_dense(double density, double fitting, uint64_t max_texels) {
  if (!(fitting > 0))
    return fail(
        ErrorKind::kInvalidInput,
        text("the scene's charts do not fit {} pages at any density: it has too many charts", kMaxPages));
  return fail(ErrorKind::kInvalidInput,
              text("{:.6g} texels per metre need more than {} pages or {:.3g} million texels; {} would fit "
                   "(--texels-per-metre)",
                   density, kMaxPages, static_cast<double>(max_texels) / 1e6, round_down(fitting)));
}

void apply_packing(const PackResult& packed, const Masks& masks, const std::vector<MeshChartBoxes>& boxes,
                   Atlas& atlas) {
  atlas.width = packed.width;
  atlas.height = packed.height;
  atlas.pages = packed.pages;
  atlas.owner.assign(atlas.texel_count(), 0);
  for (uint32_t p = 0; p < atlas.placements.size(); ++p) {
    const MaskKey& key = masks.keys[masks.of_placement[p]];
    const PackPlace& at = packed.places[p];
    const ChartBox& box = boxes[key.charts].boxes[key.chart];
    ChartPlacement& place = atlas.placements[p] = on_centres(box, key.steps);
    place.page = at.page;
    for (int axis = 0; axis < 2; ++axis)  // once more from double: one rounding, not two
      place.offset[axis] =
          static_cast<float>((axis == 0 ? at.x : at.y) + 0.5 - box.low[axis] * double{place.scale[axis]});
    const BitImage& mask = masks.images[masks.of_placement[p]];
    for (uint32_t y = 0; y < mask.height(); ++y) {
      uint32_t* row = &atlas.owner[(size_t{at.page} * atlas.height + at.y + y) * atlas.width + at.x];
      for (uint32_t w = 0; w < mask.words_per_row(); ++w)
        for (uint64_t bits = mask.row(y)[w]; bits; bits &= bits - 1) {
          uint32_t& owner = row[64 * w + static_cast<uint32_t>(std::countr_zero(bits))];
          KILN_CHECK(owner == 0);
          owner = p + 1;
          ++atlas.statistics.mask_texels;
        }
    }
  }
}

void choose_charts(const Scene& scene, const AtlasSettings& settings, Atlas& atlas) {
  std::vector<ChartsForPacking> made(scene.meshes.size());
  parallel_for(
      made.size(), [&](size_t m) { made[m] = charts_for_packing(scene.meshes[m], settings.crease_degrees); },
      settings.threads);
  std::vector<std::string> absent;
  atlas.charts.resize(made.size());
  for (size_t m = 0; m < made.size(); ++m) {
    if (!made[m].complaint.empty())
      atlas.warnings.push_back(
          text("mesh {} {}: its charts were made from its faces", mesh_name(scene, m), made[m].complaint));
    else if (made[m].charts.generated)
      absent.push_back(mesh_name(scene, m));
    atlas.statistics.generated_meshes += made[m].charts.generated;
    atlas.charts[m] = std::move(made[m].charts);
  }
  if (!absent.empty())
    atlas.warnings.push_back(
        text("{} of {} meshes have no TEXCOORD_1, their charts were made from their faces: {}", absent.size(),
             scene.meshes.size(), list_names(absent)));
}

void warn_of_limited(const Scene& scene, const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps,
                     Atlas& atlas) {
  std::vector<std::string> names;
  for (size_t p = 0; p < sizes.size(); ++p)
    if (steps[p].limited && (names.empty() || names.back() != instance_name(scene, sizes[p].instance)))
      names.push_back(instance_name(scene, sizes[p].instance));
  if (!names.empty())
    atlas.warnings.push_back(
        text("charts larger than a page were made smaller, so these have fewer texels per metre: {}",
             list_names(names)));
}

}  // namespace

Expected<Atlas> layout_packed(const Scene& scene, const AtlasSettings& settings) {
  Atlas atlas;
  atlas.packed = true;
  std::vector<StageTime>& steps_taken = atlas.statistics.steps;
  {
    const StageTimer timer(steps_taken, "charts");
    choose_charts(scene, settings, atlas);
  }
  for (const Instance& instance : scene.instances) atlas.charts_of_instance.push_back(instance.mesh);
  if (settings.cut_contacts) {
    const StageTimer timer(steps_taken, "contacts");
    cut_at_contacts(scene, std::vector<double>(scene.instances.size(), 1.0 / settings.texels_per_metre),
                    settings.threads, atlas);
  }
  KILN_TRY_STATUS(number_placements(scene, atlas));
  if (atlas.placements.empty()) return atlas;

  const std::vector<MeshChartBoxes> boxes = chart_boxes(atlas, settings.threads);
  const std::vector<ChartSize> sizes = chart_sizes(scene, atlas, boxes, settings.threads);
  const uint64_t page = uint64_t{settings.max_page_size} * settings.max_page_size;
  const double limit = static_cast<double>(std::min(settings.max_texels, kMaxPages * page));
  const auto refuse = [&] {
    const double density = settings.texels_per_metre;
    return too_dense(density, fitting_density(sizes, 0.95 * density, settings.max_page_size, 0.9 * limit),
                     settings.max_texels);
  };
  if (texels_needed(sizes, settings.texels_per_metre, settings.max_page_size) > limit) return refuse();

  std::vector<Steps> steps(sizes.size());
  for (size_t p = 0; p < sizes.size(); ++p)
    steps[p] = chart_steps(sizes[p], settings.texels_per_metre, settings.max_page_size);
  warn_of_limited(scene, sizes, steps, atlas);
  Masks masks = distinct_masks(sizes, steps);
  {
    const StageTimer timer(steps_taken, "masks");
    make_masks(atlas, boxes, masks, settings.threads);
  }
  std::vector<const BitImage*> items(sizes.size());
  for (size_t p = 0; p < items.size(); ++p) items[p] = &masks.images[masks.of_placement[p]];
  PackResult packed;
  {
    const StageTimer timer(steps_taken, "pack");
    packed = pack_masks(items, {.max_page_size = settings.max_page_size, .max_pages = kMaxPages});
  }
  if (!packed.fits || uint64_t{packed.width} * packed.height * packed.pages > settings.max_texels)
    return refuse();
  apply_packing(packed, masks, boxes, atlas);
  const StageTimer timer(steps_taken, "sites");
  KILN_TRY(const SiteOverlap overlap, find_sites(atlas, settings.threads));
  atlas.statistics.distinct_masks = masks.keys.size();
  atlas.statistics.overlapped_points = overlap.points;
  return atlas;
}

}  // namespace kiln
