#include "common/unwrap/charts.h"

#include <array>

#include "common/base/format.h"
#include "common/raster/coverage.h"
#include "common/unwrap/unwrap_cache.h"

namespace kiln {
namespace {

// Above this share of its area a mesh's TEXCOORD_1 counts as unusable. Hidden faces may have no area: our own
// scene.glb has such faces below walls.
constexpr double kMaxDegenerate = 0.25;
constexpr double kMaxOverlap = 0.005;

// Moves charts far from the unit square back by whole numbers: offsets are floats, and at
// 8192 texels a chart at u = 1000 would be placed to within a texel only.
void bring_near(MeshCharts& charts) {
  constexpr float kFar = 4.0f;
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<Vec2> lo(charts.chart_count, Vec2(inf)), hi(charts.chart_count, Vec2(-inf));
  for (size_t i = 0; i < charts.corner_uv.size(); ++i) {
    const uint32_t chart = charts.chart_of_face[i / 3];
    lo[chart] = glm::min(lo[chart], charts.corner_uv[i]);
    hi[chart] = glm::max(hi[chart], charts.corner_uv[i]);
  }
  for (size_t i = 0; i < charts.corner_uv.size(); ++i) {
    const uint32_t chart = charts.chart_of_face[i / 3];
    for (int axis = 0; axis < 2; ++axis)
      if (lo[chart][axis] < -kFar || hi[chart][axis] > kFar)
        charts.corner_uv[i][axis] -= std::floor(lo[chart][axis]);
  }
}

}  // namespace

double degenerate_share(const Mesh& mesh, const MeshCharts& charts) {
  if (charts.corner_uv.empty()) return 0;
  DVec2 lo(charts.corner_uv[0]), hi = lo;
  for (const Vec2& uv : charts.corner_uv) {
    lo = glm::min(lo, DVec2(uv));
    hi = glm::max(hi, DVec2(uv));
  }
  const double least = 1e-12 * (hi.x - lo.x) * (hi.y - lo.y);
  double all = 0, flat = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const UVec3& v = mesh.triangles[t];
    const DVec3 a(mesh.positions[v.x]), b(mesh.positions[v.y]), c(mesh.positions[v.z]);
    const double area = length(cross(b - a, c - a));
    all += area;
    if (!(std::abs(area2(uv_triangle(charts, t))) > least)) flat += area;
  }
  return all > 0 ? flat / all : 1.0;
}

namespace {

// +1, -1: the triangle lies left or right of its side a -> b in lightmap space; 0: it has no area.
int side_of(const MeshCharts& charts, const std::vector<uint32_t>& weld, const Edge& edge) {
  const double area = area2(uv_triangle(charts, edge.triangle));
  if (area == 0) return 0;
  return (area > 0) == (weld[edge.from] == edge.a) ? 1 : -1;
}

// Joins the triangles at one side of the mesh: pairs of left and right ones, so that coincident sheets stay
// separate.
void join_at_edge(std::span<const Edge> edges, const MeshCharts& charts, const std::vector<uint32_t>& weld,
                  UnionFind& sets) {
  std::vector<uint32_t> left, right;
  for (const Edge& e : edges) {
    const int side = side_of(charts, weld, e);
    if (side == 0)
      sets.merge(edges[0].triangle, e.triangle);
    else
      (side > 0 ? left : right).push_back(e.triangle);
  }
  for (size_t k = 0; k < std::min(left.size(), right.size()); ++k) sets.merge(left[k], right[k]);
}

// Chart numbers in the order of their first triangles.
void number_charts(UnionFind& sets, MeshCharts& charts) {
  std::vector<uint32_t> number(charts.chart_of_face.size());
  for (uint32_t t = 0; t < number.size(); ++t) {
    const uint32_t root = sets.find(t);
    if (root == t) number[t] = charts.chart_count++;
    charts.chart_of_face[t] = number[root];
  }
}

double overlap_of_chart(const MeshCharts& charts, std::span<const uint32_t> triangles, uint64_t& covered) {
  DVec2 lo(charts.corner_uv[3 * size_t{triangles[0]}]), hi = lo;
  for (uint32_t t : triangles)
    for (const DVec2& c : uv_triangle(charts, t).c) {
      lo = glm::min(lo, c);
      hi = glm::max(hi, c);
    }
  const DVec2 extent = hi - lo;
  const double longest = std::max(extent.x, extent.y);
  if (!(longest > 0)) return 0;
  // About 64 points a triangle, as in a texel that belongs to one.
  const double side = std::clamp(std::sqrt(static_cast<double>(triangles.size())), 4.0, 128.0);
  const double scale = side / longest;
  const TexelRect all{0, 0, static_cast<int64_t>(extent.x * scale) + 1,
                      static_cast<int64_t>(extent.y * scale) + 1};
  std::vector<uint64_t> seen(static_cast<size_t>(all.x1 * all.y1));
  uint64_t twice = 0;
  for (uint32_t t : triangles) {
    Triangle2 scaled = uv_triangle(charts, t);
    for (DVec2& c : scaled.c) c = (c - lo) * scale;
    for_each_cover(scaled, all, [&](uint32_t x, uint32_t y, uint64_t mask) {
      uint64_t& texel = seen[size_t{y} * static_cast<size_t>(all.x1) + x];
      twice += static_cast<uint64_t>(std::popcount(texel & mask));
      texel |= mask;
    });
  }
  for (uint64_t mask : seen) covered += static_cast<uint64_t>(std::popcount(mask));
  return static_cast<double>(twice);
}

}  // namespace

ChartTriangles triangles_by_chart(const MeshCharts& charts) {
  ChartTriangles by;
  by.first.resize(charts.chart_count + 1);
  for (uint32_t chart : charts.chart_of_face) ++by.first[chart + 1];
  std::partial_sum(by.first.begin(), by.first.end(), by.first.begin());
  by.triangles.resize(charts.chart_of_face.size());
  std::vector<uint32_t> next(by.first.begin(), by.first.end() - 1);
  for (uint32_t t = 0; t < by.triangles.size(); ++t) by.triangles[next[charts.chart_of_face[t]]++] = t;
  return by;
}

Expected<MeshCharts> authored_charts(const Mesh& mesh) {
  const auto refuse = [](std::string why) { return fail(ErrorKind::kInvalidInput, std::move(why)); };
  MeshCharts charts;
  if (mesh.triangles.empty()) return charts;
  if (mesh.uv[1].empty()) return refuse("has no TEXCOORD_1");
  charts.corner_uv.reserve(3 * mesh.triangles.size());
  for (const UVec3& v : mesh.triangles)
    for (int k = 0; k < 3; ++k) charts.corner_uv.push_back(mesh.uv[1][v[k]]);
  for (const Vec2& uv : charts.corner_uv)
    if (!(std::abs(uv.x) < 1e6f && std::abs(uv.y) < 1e6f))
      return refuse("has a TEXCOORD_1 that is not a number or is beyond any atlas");
  const double flat = degenerate_share(mesh, charts);
  if (flat > kMaxDegenerate)
    return refuse(text("has a TEXCOORD_1 in which {:.3g} % of its surface have no area", 100 * flat));

  charts.chart_of_face.resize(mesh.triangles.size());
  const std::vector<uint32_t> weld = weld_corners(mesh, mesh.uv[1]);
  const std::vector<Edge> edges = sorted_edges(weld);
  UnionFind sets(mesh.triangles.size());
  for (size_t i = 0, end; i < edges.size(); i = end) {
    for (end = i; end < edges.size() && edges[end].a == edges[i].a && edges[end].b == edges[i].b;) ++end;
    if (end - i > 1) join_at_edge({&edges[i], end - i}, charts, weld, sets);
  }
  number_charts(sets, charts);
  return charts;
}

double self_overlap(const MeshCharts& charts) {
  const ChartTriangles by = triangles_by_chart(charts);
  uint64_t covered = 0;
  double twice = 0;
  for (uint32_t chart = 0; chart < charts.chart_count; ++chart)
    twice += overlap_of_chart(charts, by.of(chart), covered);
  return covered ? twice / static_cast<double>(covered) : 0.0;
}

ChartsForPacking charts_for_packing(const Mesh& mesh, const UnwrapChoice& choice, unsigned threads) {
  ChartsForPacking result;
  if (!choice.always) {
    Expected<MeshCharts> own = authored_charts(mesh);
    if (own) {
      bring_near(*own);
      const double share = self_overlap(*own);
      if (share <= kMaxOverlap) {
        result.charts = std::move(*own);
        return result;
      }
      result.complaint =
          text("has a TEXCOORD_1 whose charts overlap themselves in {:.3g} % of their area", 100 * share);
    } else if (!mesh.uv[1].empty()) {
      result.complaint = own.error().message;
    }
  }
  UnwrapResult made = unwrap_cached(mesh, choice.settings, choice.cache, threads);
  result.charts = std::move(made.charts);
  result.limited = std::move(made.limited);
  return result;
}

}  // namespace kiln
