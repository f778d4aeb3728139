#include "common/atlas/atlas_lookup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/check.h"

namespace kiln {
namespace {

constexpr size_t kManyParts = 24;  // of a triangle: from here on they are found by cells

// Cells of [0, 1] that an interval touches, with slack for rounding.
uint32_t cell_of(double at, uint32_t side, double slack) {
  return static_cast<uint32_t>(std::clamp(at * side + slack, 0.0, side - 1.0));
}

}  // namespace

AtlasLookup::Grid AtlasLookup::make_grid(const MeshCharts& charts, std::span<const uint32_t> faces) {
  Grid grid;
  grid.side = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(faces.size())), 1.0, 256.0));
  std::vector<std::vector<uint32_t>> cells(size_t{grid.side} * grid.side);
  for (const uint32_t face : faces) {
    const FacePart& part = charts.parts[face];
    uint32_t low[2], high[2];
    for (int axis = 0; axis < 2; ++axis) {
      const auto [least, most] =
          std::minmax({part.corner[0][axis], part.corner[1][axis], part.corner[2][axis]});
      low[axis] = cell_of(least, grid.side, -1e-3);
      high[axis] = cell_of(most, grid.side, 1e-3);
    }
    for (uint32_t y = low[1]; y <= high[1]; ++y)
      for (uint32_t x = low[0]; x <= high[0]; ++x) cells[size_t{y} * grid.side + x].push_back(face);
  }
  grid.first.push_back(0);
  for (const std::vector<uint32_t>& cell : cells) {
    grid.faces.insert(grid.faces.end(), cell.begin(), cell.end());
    grid.first.push_back(static_cast<uint32_t>(grid.faces.size()));
  }
  return grid;
}

AtlasLookup::AtlasLookup(const Atlas& atlas) : atlas_(atlas), parts_(atlas.charts.size()) {
  for (size_t c = 0; c < parts_.size(); ++c) {
    const std::vector<FacePart>& parts = atlas.charts[c].parts;
    if (parts.empty()) continue;
    uint32_t triangles = 0;
    for (const FacePart& part : parts) triangles = std::max(triangles, part.triangle + 1);
    std::vector<uint32_t>&first = parts_[c].first, &faces = parts_[c].faces;
    first.assign(size_t{triangles} + 1, 0);
    for (const FacePart& part : parts) ++first[part.triangle + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    faces.resize(parts.size());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t f = 0; f < parts.size(); ++f) faces[next[parts[f].triangle]++] = f;
    for (uint32_t t = 0; t < triangles; ++t) {
      const std::span<const uint32_t> own(faces.data() + first[t], faces.data() + first[t + 1]);
      if (own.size() < kManyParts) continue;
      parts_[c].grid_of.resize(triangles);
      parts_[c].grids.push_back(make_grid(atlas.charts[c], own));
      parts_[c].grid_of[t] = static_cast<uint32_t>(parts_[c].grids.size());
    }
  }
}

bool AtlasLookup::holds(uint32_t instance, uint32_t triangle) const {
  if (instance >= atlas_.charts_of_instance.size()) return false;
  const Parts& parts = parts_[atlas_.charts_of_instance[instance]];
  if (parts.first.empty()) return triangle < atlas_.of_instance(instance).face_count();
  return triangle + 1 < parts.first.size() && parts.first[triangle] < parts.first[triangle + 1];
}

uint32_t AtlasLookup::face_at(uint32_t instance, uint32_t triangle, double& b1, double& b2) const {
  const Parts& parts = parts_[atlas_.charts_of_instance[instance]];
  if (parts.first.empty()) return triangle;
  const MeshCharts& charts = atlas_.of_instance(instance);
  KILN_CHECK(triangle + 1 < parts.first.size());
  uint32_t best = 0;
  double most = -std::numeric_limits<double>::infinity(), best1 = 0, best2 = 0;
  // The first of these that contains the point, or else the one it is closest to.
  const auto look_at = [&](std::span<const uint32_t> faces) {
    for (const uint32_t face : faces) {
      const FacePart& part = charts.parts[face];
      const DVec2 a(part.corner[0]), e1 = DVec2(part.corner[1]) - a, e2 = DVec2(part.corner[2]) - a;
      const DVec2 q = DVec2(b1, b2) - a;
      const double det = e1.x * e2.y - e1.y * e2.x;
      if (det == 0) continue;
      const double c1 = (q.x * e2.y - q.y * e2.x) / det, c2 = (e1.x * q.y - e1.y * q.x) / det;
      // Signed depth in the triangle's barycentrics, so that slivers do not win by their own small scale.
      const double inside = std::min({c1, c2, 1 - c1 - c2}) * std::sqrt(std::abs(det));
      if (inside > most) {
        most = inside;
        best = face;
        best1 = c1;
        best2 = c2;
      }
      if (std::min({c1, c2, 1 - c1 - c2}) >= 0) return true;
    }
    return false;
  };
  bool held = false;
  if (!parts.grid_of.empty() && parts.grid_of[triangle] > 0) {
    const Grid& grid = parts.grids[parts.grid_of[triangle] - 1];
    const size_t cell = size_t{cell_of(b2, grid.side, 0)} * grid.side + cell_of(b1, grid.side, 0);
    held = look_at({grid.faces.data() + grid.first[cell], grid.faces.data() + grid.first[cell + 1]});
    if (!held) most = -std::numeric_limits<double>::infinity();
  }
  if (!held)
    look_at({parts.faces.data() + parts.first[triangle], parts.faces.data() + parts.first[triangle + 1]});
  b1 = best1;
  b2 = best2;
  return best;
}

AtlasPlace AtlasLookup::at(uint32_t instance, uint32_t triangle, double b1, double b2) const {
  const uint32_t face = face_at(instance, triangle, b1, b2);
  const MeshCharts& charts = atlas_.of_instance(instance);
  AtlasPlace place;
  place.placement = atlas_.instance_first_chart[instance] + charts.chart_of_face[face];
  const ChartPlacement& chart = atlas_.placements[place.placement];
  const Triangle2 uv = uv_triangle(charts, face);
  place.texels = chart.to_texels(uv.c[0] + b1 * (uv.c[1] - uv.c[0]) + b2 * (uv.c[2] - uv.c[0]));
  place.page = chart.page;
  return place;
}

}  // namespace kiln
