#include "common/atlas/chart_size.h"

#include <bit>

#include "common/base/parallel.h"
#include "common/raster/triangle2.h"

namespace kiln {
namespace {

// Upper bound on the aspect correction of a chart, whatever its parameterisation.
constexpr double kMaxRatio = 64.0;

// Sums over the triangles of one placed chart.
struct Measure {
  double area = 0;                  // in the world
  double along_u = 0, along_v = 0;  // area-weighted squares of |dP/du|, |dP/dv|
};

void add_triangle(const DVec3& e1, const DVec3& e2, const Triangle2& uv, Measure& m) {
  const double det = area2(uv);
  if (det == 0) return;  // invisible, or an error in the file: it gets no texels
  const double area = 0.5 * length(cross(e1, e2));
  m.area += area;
  const DVec2 d1 = uv.c[1] - uv.c[0], d2 = uv.c[2] - uv.c[0];
  const DVec3 du = (e1 * d2.y - e2 * d1.y) / det, dv = (e2 * d1.x - e1 * d2.x) / det;
  m.along_u += area * dot(du, du);
  m.along_v += area * dot(dv, dv);
}

DVec2 metres_of(const Measure& m, const ChartBox& box) {
  if (!(box.area > 0) || !(m.area > 0)) return DVec2(0.0);
  const double scale = std::sqrt(m.area / box.area);
  double ratio = m.along_v > 0 ? std::sqrt(std::sqrt(m.along_u / m.along_v)) : 1.0;
  if (!std::isfinite(ratio)) ratio = 1.0;
  ratio = std::clamp(ratio, 1 / kMaxRatio, kMaxRatio);
  return box.extent * DVec2(scale * ratio, scale / ratio);
}

uint32_t steps_along(double texels, uint32_t most, bool& limited) {
  constexpr double kSlack = 1e-3;  // 16.0000001 texels are 16
  const double steps = std::ceil(texels - kSlack);
  if (!(steps <= most)) limited = true;
  const double page = most;
  return static_cast<uint32_t>(std::clamp(std::isfinite(steps) ? steps : page, 1.0, page));
}

double mask_texels(const ChartSize& size, const Steps& s, double density, const PackRules& rules) {
  // Border around the chart: half a texel (of the last mip level) that a lookup reads, and on average a
  // quarter of a cell on either side from rounding up to whole cells.
  const double around = 0.5 * rules.mip_cell + 0.25 * (rules.cell - 1.0);
  const double box = (s.x + 2 * around) * (s.y + 2 * around);
  // If its border is no longer than twice its box's.
  return std::min(box,
                  size.square_metres * density * density + 4 * around * (s.x + s.y) + 8 * around * around);
}

// Share of a page per chart if the page held only charts of this size.
double page_texels(const Steps& s, uint32_t max_page_size) {
  const auto beside = [=](uint32_t steps) { return std::floor(max_page_size / (steps + 1.0)); };
  return double{1.0} * max_page_size * max_page_size / (beside(s.x) * beside(s.y));
}

}  // namespace

std::vector<MeshChartBoxes> chart_boxes(const Atlas& atlas, unsigned threads) {
  std::vector<MeshChartBoxes> result(atlas.charts.size());
  parallel_for(
      result.size(),
      [&](size_t m) {
        const MeshCharts& charts = atlas.charts[m];
        result[m].triangles = triangles_by_chart(charts);
        for (uint32_t chart = 0; chart < charts.chart_count; ++chart) {
          const double inf = std::numeric_limits<double>::infinity();
          DVec2 low(inf), high(-inf);
          ChartBox& box = result[m].boxes.emplace_back();
          for (uint32_t t : result[m].triangles.of(chart)) {
            const Triangle2 uv = uv_triangle(charts, t);
            low = glm::min(low, DVec2(uv.min_x(), uv.min_y()));
            high = glm::max(high, DVec2(uv.max_x(), uv.max_y()));
            box.area += 0.5 * std::abs(area2(uv));
          }
          box.low = low;
          box.extent = high - low;
        }
      },
      threads);
  return result;
}

std::vector<ChartSize> chart_sizes(const Scene& scene, const Atlas& atlas,
                                   const std::vector<MeshChartBoxes>& boxes,
                                   const std::vector<float>& density, unsigned threads) {
  std::vector<ChartSize> sizes(atlas.placements.size());
  parallel_for(
      scene.instances.size(),
      [&](size_t i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[instance.mesh];
        const MeshCharts& charts = atlas.of_instance(i);
        const uint32_t set = atlas.charts_of_instance[i];
        std::vector<Measure> measures(charts.chart_count);
        for (size_t f = 0; f < charts.face_count(); ++f) {
          Vec3 c[3];
          face_corners(mesh, charts, f, c);
          add_triangle(DVec3(transform_vector(instance.to_world, c[1] - c[0])),
                       DVec3(transform_vector(instance.to_world, c[2] - c[0])), uv_triangle(charts, f),
                       measures[charts.chart_of_face[f]]);
        }
        const double d = density.empty() ? 1.0 : density[i];
        for (uint32_t chart = 0; chart < charts.chart_count; ++chart)
          sizes[atlas.instance_first_chart[i] + chart] = {
              static_cast<uint32_t>(i), set, chart, d * metres_of(measures[chart], boxes[set].boxes[chart]),
              d * d * measures[chart].area};
      },
      threads);
  return sizes;
}

PackRules pack_rules(const AtlasSettings& settings) {
  PackRules rules;
  rules.mip_cell = 1u << settings.mip_levels;
  rules.cell = std::max(settings.block_align ? 4u : 1u, rules.mip_cell);
  const uint32_t page =
      settings.power_of_two ? std::bit_floor(settings.max_page_size) : settings.max_page_size;
  rules.most = page / rules.cell * rules.cell - (rules.mip_cell > 1 ? rules.mip_cell : 0);
  return rules;
}

Steps chart_steps(const ChartSize& size, double density, const PackRules& rules) {
  Steps steps{1, 1, false};
  steps.x = steps_along(size.metres.x * density, rules.most - 1, steps.limited);
  steps.y = steps_along(size.metres.y * density, rules.most - 1, steps.limited);
  return steps;
}

double texels_needed(const std::vector<ChartSize>& sizes, double density, const PackRules& rules) {
  double sum = 0;
  for (const ChartSize& size : sizes)
    sum += mask_texels(size, chart_steps(size, density, rules), density, rules);
  return sum;
}

double fitting_density(const std::vector<ChartSize>& sizes, double density, const PackRules& rules,
                       double limit) {
  const auto needed = [&](double d) {
    double sum = 0;
    for (const ChartSize& size : sizes) {
      const Steps s = chart_steps(size, d, rules);
      const bool large = 8 * std::max(s.x, s.y) > rules.most;
      sum += large ? page_texels(s, rules.most) : mask_texels(size, s, d, rules);
    }
    return sum;
  };
  double low = 0, high = density;
  if (needed(0) > limit) return 0;
  for (int step = 0; step < 50; ++step) {
    const double middle = 0.5 * (low + high);
    (needed(middle) <= limit ? low : high) = middle;
  }
  return low;
}

double layout_texels(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings, double density) {
  const std::vector<MeshChartBoxes> boxes = chart_boxes(atlas, settings.threads);
  return texels_needed(chart_sizes(scene, atlas, boxes, settings.density, settings.threads), density,
                       pack_rules(settings));
}

}  // namespace kiln
