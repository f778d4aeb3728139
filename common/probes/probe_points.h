// The points of a job's probes, as workers get them: a chunk, named by its content like every other.
#pragma once

#include <span>
#include <vector>

#include "common/base/fields.h"
#include "common/math/vec.h"

namespace kiln {

struct ProbePoint {
  Vec3 position{0.0f};  // world, metres
  float reach = 0.0f;   // distances are cut off here, metres; above 0
};

struct ProbePoints {
  std::vector<ProbePoint> points;
  static void fields(auto& p, auto& v) { v(p.points); }
};

Bytes write_probe_points(const ProbePoints& points);
// Fails (kInvalidInput) unless there is a point, all are finite and every reach is above 0.
Expected<ProbePoints> read_probe_points(std::span<const std::byte> bytes);

}  // namespace kiln
