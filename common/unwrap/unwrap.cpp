#include "common/unwrap/unwrap.h"

#include <algorithm>
#include <numeric>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/unwrap/layers.h"
#include "common/unwrap/merge.h"

namespace kiln {
namespace {

struct Piece {
  std::vector<FlatChart> charts;
  std::vector<uint32_t> refused;  // faces left when the work was spent
  uint64_t work = 0;
};

// Halves the piece until each part flattens. Ends at single faces, which always do.
Piece flatten_or_split(const Surface& surface, ChartState& state, std::vector<uint32_t> faces,
                       const FlattenLimits& limits, uint64_t max_work) {
  Piece piece;
  FaceSets open;
  open.push_back(std::move(faces));
  while (!open.empty()) {
    std::vector<uint32_t> next = std::move(open.back());
    open.pop_back();
    if (next.size() > 1 && piece.work >= max_work) {
      piece.refused.insert(piece.refused.end(), next.begin(), next.end());
      continue;
    }
    if (std::optional<FlatChart> chart = flatten(surface, state, next, limits, piece.work)) {
      piece.charts.push_back(std::move(*chart));
      continue;
    }
    piece.work += next.size();
    for (std::vector<uint32_t>& part : split_chart(surface, state, next)) open.push_back(std::move(part));
  }
  return piece;
}

// Over the budget: the largest charts keep half of it, and the faces of all others go to layers.
std::vector<uint32_t> drop_small_charts(std::vector<FlatChart>& charts, uint32_t max_charts) {
  std::sort(charts.begin(), charts.end(), [](const FlatChart& a, const FlatChart& b) {
    return a.area != b.area ? a.area > b.area : a.faces[0] < b.faces[0];
  });
  std::vector<uint32_t> faces;
  for (size_t i = max_charts / 2; i < charts.size(); ++i)
    faces.insert(faces.end(), charts[i].faces.begin(), charts[i].faces.end());
  charts.resize(max_charts / 2);
  std::sort(faces.begin(), faces.end());
  return faces;
}

// Charts in the order of their first faces.
void store(const Surface& surface, std::vector<FlatChart>& charts, UnwrapResult& result) {
  std::sort(charts.begin(), charts.end(),
            [](const FlatChart& a, const FlatChart& b) { return a.faces[0] < b.faces[0]; });
  MeshCharts& out = result.charts;
  const size_t count = surface.face_count();
  out.generated = true;
  out.chart_of_face.assign(count, Surface::kNone);
  out.corner_uv.assign(3 * count, Vec2(0.0f));
  double sum = 0, area = 0;
  for (const FlatChart& chart : charts) {
    for (size_t i = 0; i < chart.faces.size(); ++i) {
      out.chart_of_face[chart.faces[i]] = out.chart_count;
      for (size_t k = 0; k < 3; ++k) out.corner_uv[3 * size_t{chart.faces[i]} + k] = Vec2(chart.flat[i].c[k]);
    }
    ++out.chart_count;
    sum += chart.stretch.l2 * chart.stretch.l2 * chart.area;
    area += chart.area;
    result.stretch.linf = std::max(result.stretch.linf, chart.stretch.linf);
  }
  if (area > 0) result.stretch.l2 = std::sqrt(sum / area);
}

// A degenerate face collapses to a corner of an adjacent face, or joins any chart if it has none.
void attach_degenerate(const Surface& surface, MeshCharts& charts) {
  for (uint32_t f = 0; f < surface.face_count(); ++f) {
    if (surface.area[f] > 0) continue;
    const uint32_t host = surface.attached[f];
    charts.chart_of_face[f] = host == Surface::kNone ? 0 : charts.chart_of_face[host];
    for (size_t k = 0; k < 3; ++k)
      charts.corner_uv[3 * size_t{f} + k] =
          host == Surface::kNone ? Vec2(0.0f) : charts.corner_uv[3 * size_t{host}];
  }
  if (charts.chart_count == 0 && surface.face_count() > 0) charts.chart_count = 1;
}

}  // namespace

UnwrapResult unwrap(const Mesh& mesh, const UnwrapSettings& settings, unsigned threads) {
  const Surface surface(mesh, settings.crease_degrees);
  ChartState state(surface);
  FaceSets grown = grow_charts(surface, state, settings.grow);
  std::vector<Piece> pieces(grown.size());
  const double share =
      static_cast<double>(settings.max_work) / static_cast<double>(std::max<size_t>(1, surface.face_count()));
  parallel_for(
      grown.size(),
      [&](size_t i) {
        const auto most = static_cast<uint64_t>(share * static_cast<double>(grown[i].size()));
        pieces[i] = flatten_or_split(surface, state, std::move(grown[i]), settings.limits, most);
      },
      threads);
  UnwrapResult result;
  std::vector<FlatChart> charts;
  std::vector<uint32_t> refused;
  uint64_t work = 0;
  for (Piece& piece : pieces) {
    work += piece.work;
    std::move(piece.charts.begin(), piece.charts.end(), std::back_inserter(charts));
    refused.insert(refused.end(), piece.refused.begin(), piece.refused.end());
  }
  const uint64_t for_merging = settings.merge_work_per_face * (surface.face_count() + 300);
  merge_charts(surface, state, charts,
               {.limits = settings.limits,
                .max_faces = settings.grow.max_faces,
                .work = std::min(settings.max_work, work + for_merging)},
               threads, work);
  if (charts.size() > settings.max_charts) {
    const std::vector<uint32_t> dropped = drop_small_charts(charts, settings.max_charts);
    refused.insert(refused.end(), dropped.begin(), dropped.end());
  }
  if (!refused.empty()) {
    std::sort(refused.begin(), refused.end());
    result.limited =
        text("is beyond the limits of unwrapping: {} of its {} triangles were projected along the axes",
             refused.size(), surface.face_count());
    std::vector<FlatChart> cheap = layered_charts(surface, refused);
    std::move(cheap.begin(), cheap.end(), std::back_inserter(charts));
  }
  store(surface, charts, result);
  attach_degenerate(surface, result.charts);
  return result;
}

}  // namespace kiln
