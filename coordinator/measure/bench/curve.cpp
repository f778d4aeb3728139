#include "coordinator/measure/bench/curve.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

Crossing find_crossing(const std::vector<double>& cost, const std::vector<double>& error, double target) {
  const auto seen = [&](size_t i) { return error[i] > 0 ? error[i] : 0.1 * target; };
  for (size_t i = 0; i < cost.size(); ++i) {
    if (seen(i) > target) continue;
    if (i == 0) return {Crossing::Kind::kBelow, cost[0]};
    const double part = std::log(seen(i - 1) / target) / std::log(seen(i - 1) / seen(i));
    return {Crossing::Kind::kReached, cost[i - 1] * std::pow(cost[i] / cost[i - 1], part)};
  }
  return {Crossing::Kind::kNotReached, cost.empty() ? 0 : cost.back()};
}

std::string crossing_text(const Crossing& c) {
  if (c.cost <= 0) return "";
  const char* sign = c.kind == Crossing::Kind::kReached ? "" : c.kind == Crossing::Kind::kBelow ? "< " : "> ";
  return text("{}{:.3g}", sign, c.cost);
}

}  // namespace kiln
