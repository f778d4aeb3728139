// Error against cost: medians of repeats, and the cost at which a curve reaches an error.
#pragma once

#include <string>
#include <vector>

namespace kiln {

double median(std::vector<double> values);  // of an even number: mean of the middle two; of none: 0

struct CurvePoint {
  std::string budget;
  double seconds = 0, core_seconds = 0, rays = 0, rel_mse = 0;  // medians of the repeats
};

struct Crossing {
  enum class Kind { kReached, kBelow, kNotReached };
  Kind kind = Kind::kNotReached;
  double cost = 0;  // kBelow: of the first point, already better; kNotReached: of the last point
};

// Where the curve first falls to `target`, interpolated linearly in the logarithms between two
// points. `cost` and `error` are in budget order and have equal lengths. Errors of 0 or below (too
// small to measure) count as a tenth of the target.
Crossing find_crossing(const std::vector<double>& cost, const std::vector<double>& error, double target);

// "12.3", "< 0.5", "> 60"; without points: "".
std::string crossing_text(const Crossing& crossing);

}  // namespace kiln
