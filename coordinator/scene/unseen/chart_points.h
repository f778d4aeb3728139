// Points on a chart from which is asked what can be seen.
#pragma once

#include <span>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

struct ChartPoint {
  Vec3 position, normal;  // in the world; the normal is unit, of the winding's front
  uint32_t triangle = 0;
};

// The faces of one placed chart that have texels, and their areas.
class ChartSurface {
 public:
  // `faces`: of the chart, indices into the instance's set of charts. All outlive it.
  ChartSurface(const Scene& scene, const Atlas& atlas, uint32_t instance, std::span<const uint32_t> faces);

  bool empty() const { return faces_.empty(); }
  // Point k of `count`, spread evenly over the area; `key` decides where. The same for any caller.
  ChartPoint spread(uint32_t k, uint32_t count, uint64_t key) const;
  // Corners of faces, a little way inside them: what reaches out of a wall by a hand's breadth. At most
  // `most`.
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
