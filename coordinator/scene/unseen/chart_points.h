// Points on a chart for visibility queries.
#pragma once

#include <span>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

struct ChartPoint {
  Vec3 position, normal;  // world space; unit normal on the front by winding
  uint32_t triangle = 0;
};

// The faces of one placed chart that have texels, and their areas.
class ChartSurface {
 public:
  // `faces`: of the chart, indices into the instance's set of charts. All outlive it.
  ChartSurface(const Scene& scene, const Atlas& atlas, uint32_t instance, std::span<const uint32_t> faces);

  bool empty() const { return faces_.empty(); }
  // Point k of `count`, spread evenly over the area; `key` seeds the positions, which are deterministic.
  ChartPoint spread(uint32_t k, uint32_t count, uint64_t key) const;
  // Points just inside the corners of faces, for surface that reaches slightly out of a wall. At most `most`.
  std::vector<ChartPoint> corners(size_t most) const;

 private:
  ChartPoint at(size_t face, float b1, float b2) const;

  const Scene& scene_;
  const MeshCharts& charts_;
  const uint32_t instance_;
  std::vector<uint32_t> faces_;
  std::vector<double> area_;  // running sum, square metres
};

}  // namespace kiln
