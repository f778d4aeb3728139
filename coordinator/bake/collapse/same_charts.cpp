#include "coordinator/bake/collapse/same_charts.h"

#include <charconv>
#include <optional>

#include "common/atlas/atlas_lookup.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

bool are_equal(const MeshCharts& a, const MeshCharts& b) {
  const auto same_part = [](const FacePart& p, const FacePart& q) {
    return p.triangle == q.triangle && std::equal(p.corner, p.corner + 3, q.corner);
  };
  return a.chart_count == b.chart_count && a.chart_of_face == b.chart_of_face && a.corner_uv == b.corner_uv &&
         std::equal(a.parts.begin(), a.parts.end(), b.parts.begin(), b.parts.end(), same_part);
}

// Points of a face that identify its old chart: near its corners, and its centre. Barycentrics (b1, b2) of
// its triangle.
std::array<DVec2, 4> points_of(const MeshCharts& charts, size_t face) {
  constexpr double kInside = 0.9;
  const FacePart whole;
  const Vec2(&corner)[3] = charts.parts.empty() ? whole.corner : charts.parts[face].corner;
  const DVec2 middle = (DVec2(corner[0]) + DVec2(corner[1]) + DVec2(corner[2])) / 3.0;
  std::array<DVec2, 4> points;
  for (size_t k = 0; k < 3; ++k) points[k] = middle + kInside * (DVec2(corner[k]) - middle);
  points[3] = middle;
  return points;
}

// By chart of the new set: the chart of the old one.
std::vector<uint32_t> found_by_place(const AtlasLookup& lookup, uint32_t instance, const MeshCharts& from,
                                     const MeshCharts& to) {
  std::vector<uint32_t> same(to.chart_count, kNoChart);
  std::vector<uint8_t> several(to.chart_count, 0);
  for (size_t face = 0; face < to.face_count(); ++face) {
    if (area2(uv_triangle(to, face)) == 0) continue;  // cut away below a standing object
    const uint32_t chart = to.chart_of_face[face], triangle = to.triangle_of(face);
    for (const DVec2& point : points_of(to, face)) {
      double b1 = point.x, b2 = point.y;
      const uint32_t old =
          lookup.holds(instance, triangle) ? lookup.face_at(instance, triangle, b1, b2) : kNoChart;
      if (old == kNoChart || area2(uv_triangle(from, old)) == 0) {
        several[chart] = 1;
        continue;
      }
      const uint32_t known = from.chart_of_face[old];
      if (same[chart] != kNoChart && same[chart] != known) several[chart] = 1;
      same[chart] = known;
    }
  }
  for (size_t chart = 0; chart < several.size(); ++chart)
    if (several[chart]) same[chart] = kNoChart;
  return same;
}

}  // namespace

std::vector<uint32_t> same_charts(const Atlas& from, const Atlas& to) {
  KILN_CHECK(from.charts_of_instance.size() == to.charts_of_instance.size());
  std::vector<uint32_t> same(to.instance_first_chart.back(), kNoChart);
  const AtlasLookup lookup(from);
  parallel_for(to.charts_of_instance.size(), [&](size_t i) {
    const MeshCharts &before = from.of_instance(i), &after = to.of_instance(i);
    const uint32_t first = from.instance_first_chart[i], own = to.instance_first_chart[i];
    if (are_equal(before, after)) {
      for (uint32_t c = 0; c < after.chart_count; ++c) same[own + c] = first + c;
      return;
    }
    const std::vector<uint32_t> found = found_by_place(lookup, static_cast<uint32_t>(i), before, after);
    for (uint32_t c = 0; c < after.chart_count; ++c)
      if (found[c] != kNoChart) same[own + c] = first + found[c];
  });
  return same;
}

std::string list_charts(const std::vector<uint8_t>& charts, CollapseReason reason) {
  std::string out;
  for (size_t first = 0; first < charts.size(); ++first) {
    if (charts[first] != reason) continue;
    size_t last = first;
    while (last + 1 < charts.size() && charts[last + 1] == reason) ++last;
    if (!out.empty()) out += ",";
    out += first == last ? text("{}", first) : text("{}-{}", first, last);
    first = last;
  }
  return out;
}

bool read_charts(std::string_view list, CollapseReason reason, std::vector<uint8_t>& charts) {
  const char *at = list.data(), *const end = at + list.size();
  const auto number = [&]() -> std::optional<size_t> {
    size_t value = 0;
    const auto [next, code] = std::from_chars(at, end, value);
    if (code != std::errc() || value >= charts.size()) return std::nullopt;
    at = next;
    return value;
  };
  while (at != end) {
    const auto first = number();
    if (!first) return false;
    std::optional<size_t> last = first;
    if (at != end && *at == '-') {
      ++at;
      last = number();
    }
    if (!last || *last < *first) return false;
    for (size_t c = *first; c <= *last; ++c) charts[c] = reason;
    if (at != end && (*at++ != ',' || at == end)) return false;
  }
  return true;
}

}  // namespace kiln
