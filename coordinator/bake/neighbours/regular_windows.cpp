#include "coordinator/bake/neighbours/regular_windows.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "common/base/check.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr float kOffGrid = 1e-3f;         // texels that a step may be longer, shorter or askew
constexpr float kSameNormal = 1 - 1e-6f;  // cosine
constexpr int kStepX[] = {1, -1, 0, 0}, kStepY[] = {0, 0, 1, -1};  // by way

RegularWindows::Shape make_shape() {
  constexpr int kReach = static_cast<int>(RegularWindows::kTexels);
  constexpr float kSquare = RegularWindows::kTexels * RegularWindows::kTexels;
  std::vector<std::tuple<int, int, int>> places;  // square of the distance, y, x
  for (int y = -kReach; y <= kReach; ++y)
    for (int x = -kReach; x <= kReach; ++x)
      if (static_cast<float>(x * x + y * y) < kSquare) places.push_back({x * x + y * y, y, x});
  std::sort(places.begin(), places.end());
  RegularWindows::Shape out;
  KILN_CHECK(places.size() <= out.x.size());
  for (const auto& [square, y, x] : places) {
    const size_t k = out.count++;
    out.x[k] = static_cast<int8_t>(x);
    out.y[k] = static_cast<int8_t>(y);
    out.square[k] = static_cast<float>(square);
    if (k == 0) continue;
    const size_t way = std::abs(x) >= std::abs(y) ? (x > 0 ? 0 : 1) : (y > 0 ? 2 : 3);
    size_t before = 0;
    while (out.x[before] != x - kStepX[way] || out.y[before] != y - kStepY[way]) ++before;
    out.before[k] = static_cast<uint8_t>(before);
    out.way[k] = static_cast<uint8_t>(way);
  }
  return out;
}

// The way of a link between sites beside each other on a chart's grid; kNone for others.
uint32_t way_of(const SiteGeometry& sites, uint32_t from, uint32_t to) {
  if (sites.placement[from] != sites.placement[to]) return kNone;
  const int64_t x = int64_t{sites.texel[to][0]} - sites.texel[from][0],
                y = int64_t{sites.texel[to][1]} - sites.texel[from][1];
  for (uint32_t way = 0; way < 4; ++way)
    if (x == kStepX[way] && y == kStepY[way]) return way;
  return kNone;
}

}  // namespace

const RegularWindows::Shape& RegularWindows::shape() {
  static const Shape shape = make_shape();
  return shape;
}

size_t RegularWindows::Shape::within(float texels) const {
  const auto places = square.begin() + static_cast<ptrdiff_t>(count);
  return static_cast<size_t>(std::lower_bound(square.begin() + 1, places, texels * texels) - square.begin());
}

RegularWindows::RegularWindows(const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads)
    : beside_(sites.size()), is_regular_(sites.size()) {
  for_each_index(sites.size(), threads, [&](size_t i) {
    Beside& beside = beside_[i];
    beside.fill(kNone);
    const auto site = static_cast<uint32_t>(i);
    const std::span<const uint32_t> linked = links.of(site);
    const float size = sites.texel_size[i];
    if (linked.size() != kWays || !(size > 0)) return;
    Beside found;
    found.fill(kNone);
    for (const uint32_t other : linked) {
      const uint32_t way = way_of(sites, site, other);
      if (way == kNone || !(std::abs(sites.texel_size[other] - size) <= kOffGrid * size) ||
          !(dot(sites.normal[i], sites.normal[other]) >= kSameNormal))
        return;
      found[way] = other;
    }
    const auto step = [&](size_t way) { return (sites.position[found[way]] - sites.position[i]) / size; };
    for (size_t way = 0; way < kWays; ++way)
      if (found[way] == kNone) return;
    const Vec3 right = step(0), up = step(2);
    if (!(std::abs(length(right) - 1) <= kOffGrid) || !(std::abs(length(up) - 1) <= kOffGrid) ||
        !(std::abs(dot(right, up)) <= kOffGrid))
      return;
    if (!(length(right + step(1)) <= kOffGrid) || !(length(up + step(3)) <= kOffGrid)) return;
    beside = found;
  });
  for_each_run(sites.size(), threads, [&](size_t begin, size_t end) {
    std::array<uint32_t, SurfaceWindow::kMax> window;
    for (size_t i = begin; i < end; ++i)
      is_regular_[i] = walk(static_cast<uint32_t>(i), shape().count, window);
  });
}

bool RegularWindows::walk(uint32_t site, size_t count, std::span<uint32_t> out) const {
  const Shape& shape = RegularWindows::shape();
  out[0] = site;
  if (beside_[site][0] == kNone) return false;
  for (size_t k = 1; k < count; ++k) {
    const uint32_t next = beside_[out[shape.before[k]]][shape.way[k]];
    if (beside_[next][0] == kNone) return false;
    out[k] = next;
  }
  return true;
}

bool RegularWindows::find(uint32_t site, std::span<const uint8_t> known, size_t count,
                          std::span<uint32_t> out) const {
  if (!is_regular_[site]) return false;
  walk(site, count, out);
  return std::all_of(out.begin(), out.begin() + static_cast<ptrdiff_t>(count),
                     [&](uint32_t s) { return known[s]; });
}

}  // namespace kiln
