#include "common/unwrap/layers.h"

#include <array>

#include "common/unwrap/face_grid.h"

namespace kiln {
namespace {

constexpr size_t kMaxLayers = 64;
// A layer that accepts less than this share of the remaining faces ends the loop: the rest piles up in one
// place.
constexpr size_t kMinShare = 256;

// 0 to 5: +x, -x, +y, -y, +z, -z.
uint32_t dominant(const DVec3& n) {
  const DVec3 size(std::abs(n.x), std::abs(n.y), std::abs(n.z));
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return static_cast<uint32_t>(2 * axis + (n[axis] < 0));
}

DVec2 project(const DVec3& p, uint32_t direction) {
  const int axis = static_cast<int>(direction / 2);
  const DVec2 q(p[(axis + 1) % 3], p[(axis + 2) % 3]);
  return direction % 2 ? DVec2(q.y, q.x) : q;
}

FlatChart chart_of_layer(const Surface& surface, std::vector<uint32_t> faces, std::vector<Triangle2> flat) {
  FlatChart chart;
  DVec2 lo(std::numeric_limits<double>::infinity());
  for (const Triangle2& t : flat)
    for (const DVec2& c : t.c) lo = glm::min(lo, c);
  for (Triangle2& t : flat)
    for (DVec2& c : t.c) c = DVec2(Vec2(c - lo));
  for (uint32_t f : faces) chart.area += surface.area[f];
  chart.stretch = measure_stretch(surface, faces, flat);
  chart.faces = std::move(faces);
  chart.flat = std::move(flat);
  return chart;
}

void deal(const Surface& surface, std::vector<uint32_t> faces, uint32_t direction,
          std::vector<FlatChart>& charts) {
  for (size_t layer = 0; layer < kMaxLayers && !faces.empty(); ++layer) {
    std::vector<Triangle2> flat(faces.size());
    DVec2 lo(std::numeric_limits<double>::infinity());
    for (size_t i = 0; i < faces.size(); ++i)
      for (uint32_t k = 0; k < 3; ++k) {
        flat[i].c[k] = project(surface.corner(3 * faces[i] + k), direction);
        lo = glm::min(lo, flat[i].c[k]);
      }
    for (Triangle2& t : flat)
      for (DVec2& c : t.c) c = DVec2(Vec2(c - lo));
    FaceGrid grid(flat);
    std::vector<uint32_t> in, out;
    std::vector<Triangle2> placed;
    for (uint32_t i = 0; i < faces.size(); ++i) {
      if (area2(flat[i]) > 0 && grid.add_if_free(i))
        in.push_back(faces[i]), placed.push_back(flat[i]);
      else
        out.push_back(faces[i]);
    }
    if (in.empty()) break;
    const bool heap = in.size() * kMinShare < faces.size();
    charts.push_back(chart_of_layer(surface, std::move(in), std::move(placed)));
    faces = std::move(out);
    if (heap) break;
  }
  for (uint32_t f : faces) charts.push_back(flatten_single(surface, f));
}

}  // namespace

std::vector<FlatChart> layered_charts(const Surface& surface, const std::vector<uint32_t>& faces) {
  std::array<std::vector<uint32_t>, 6> by;
  for (uint32_t f : faces) by[dominant(surface.normal[f])].push_back(f);
  std::vector<FlatChart> charts;
  for (uint32_t d = 0; d < 6; ++d) deal(surface, by[d], d, charts);
  return charts;
}

}  // namespace kiln
