#include "coordinator/bake/seams/join.h"

#include "coordinator/bake/seams/stated.h"

namespace kiln {
namespace {

// Corrections of measured texels, in units of their reported errors.
class ChangeMeter {
 public:
  ChangeMeter(const Lightmap& map, const std::vector<uint32_t>& texels) : map_(map), texels_(texels) {
    const std::vector<float>& error = map.planes.plane("error");
    for (const uint32_t t : texels) before_.push_back(light_of(map, t)), error_.push_back(error[t]);
  }
  void finish(SeamReport& report) const {
    double sum = 0, squares = 0, change = 0, values = 0;
    uint64_t count = 0;
    for (size_t i = 0; i < texels_.size(); ++i) {
      const uint32_t t = texels_[i];
      if (map_.validity[t] == Validity::kFilled) continue;
      change += light_of(map_, t) - before_[i];
      values += before_[i];
      if (!(error_[i] > 0) || !std::isfinite(error_[i])) continue;
      const double moved = (light_of(map_, t) - before_[i]) / error_[i];
      sum += std::abs(moved);
      squares += moved * moved;
      ++count;
    }
    if (count > 0) report.change_in_errors = sum / static_cast<double>(count);
    if (count > 0) report.rms_change_in_errors = std::sqrt(squares / static_cast<double>(count));
    if (values > 0) report.bias = change / values;
  }

 private:
  const Lightmap& map_;
  const std::vector<uint32_t>& texels_;
  std::vector<double> before_, error_;
};

// Returns the number of values clamped at zero.
uint64_t apply(const std::vector<float>& before, const std::vector<uint32_t>& texels,
               const std::vector<double>& change, std::vector<float>& plane) {
  const bool negative = std::any_of(before.begin(), before.end(), [](float v) { return v < 0; });
  uint64_t held = 0;
  for (size_t i = 0; i < texels.size(); ++i) {
    if (change[i] == 0) continue;
    const double moved = double{before[i]} + change[i];
    const bool hold = moved < 0 && !negative;
    held += hold;
    plane[texels[i]] = hold                                       ? 0.0f
                       : std::isfinite(static_cast<float>(moved)) ? static_cast<float>(moved)
                                                                  : before[i];
  }
  return held;
}

void solve_planes(Lightmap& map, std::span<const SeamEquation> equations, std::span<const SeamDoubt> doubts,
                  const SeamUnknowns& unknowns, const SeamBackup& before, SeamReport& report) {
  const size_t planes = before.planes.size();
  std::vector<std::vector<double>> targets(planes);
  for (size_t k = 0; k < planes; ++k) {
    const std::vector<float>& plane = map.planes.data[before.planes[k]];
    for (size_t r = 0; r < equations.size(); ++r)
      targets[k].push_back(doubts[r].closed * seam_step(equations[r], plane));
  }
  const Solution solution = solve(unknowns.problem, targets);
  for (size_t k = 0; k < planes; ++k)
    report.held_at_zero +=
        apply(before.values[k], unknowns.texels, solution.corrections[k], map.planes.data[before.planes[k]]);
  report.residual = solution.residual;
}

// Planes are corrected independently, so in dim light a direction may become longer than the light; it is
// shortened.
uint64_t shorten_directions(Lightmap& map, std::span<const uint32_t> texels) {
  uint64_t shortened = 0;
  for (const DirectionBound& b : map.bounds)
    for (const uint32_t t : texels) {
      double square = 0;
      for (const size_t p : b.direction) square += double{map.planes.data[p][t]} * map.planes.data[p][t];
      const double light = std::max(0.0, double{map.planes.data[b.light][t]});
      if (square <= light * light * (1 + 0x1p-20)) continue;
      const double factor = light / std::sqrt(square);
      for (const size_t p : b.direction)
        map.planes.data[p][t] = static_cast<float>(map.planes.data[p][t] * factor);
      ++shortened;
    }
  return shortened;
}

void measure_agreed(const Lightmap& map, std::span<const SeamEquation> equations,
                    std::span<const SeamDoubt> doubts, const SeamWeights& weights, SeamReport& report) {
  std::vector<SeamEquation> agreed;
  double length = 0;
  for (size_t r = 0; r < equations.size(); ++r) {
    length += double{equations[r].texels};
    if (doubts[r].excess <= weights.doubt.close)
      agreed.push_back(equations[r]);
    else
      report.apart += double{equations[r].texels};
  }
  report.apart /= length;
  report.agreed = measure_steps(map, agreed);
}

}  // namespace

std::vector<SeamEquation> seams_of(const Lightmap& map, const Scene& scene, const Atlas& atlas,
                                   const SeamSettings& settings) {
  SeamFinder finder(scene, atlas);
  return seam_equations(atlas, map, finder.find(settings.angle_degrees).points);
}

SeamReport join_seams(Lightmap& map, const Scene& scene, const Atlas& atlas, const SeamSettings& settings,
                      const SeamWeights& weights) {
  SeamFinder finder(scene, atlas);
  return join_seams(map, finder, settings, weights);
}

SeamReport join_seams(Lightmap& map, SeamFinder& finder, const SeamSettings& settings,
                      const SeamWeights& weights) {
  SeamReport report;
  const Atlas& atlas = finder.atlas();
  const FoundSeams& found = finder.find(settings.angle_degrees);
  report.stretches = found.stretches.size();
  for (const SeamStretch& s : found.stretches) report.metres += s.metres;
  const std::vector<SeamEquation> equations = seam_equations(atlas, map, found.points);
  report.equations = equations.size();
  if (equations.empty()) return report;

  const std::vector<SeamDoubt> doubts = seam_doubts(atlas, map, equations, weights.doubt);
  SeamUnknowns unknowns = seam_unknowns(atlas, map, equations, doubts, weights);
  report.texels = unknowns.texels.size();
  const ChangeMeter change(map, unknowns.texels);
  const SeamBackup before = back_up(map, unknowns.texels);
  report.before = measure_steps(map, equations);
  leave_out(map, equations, doubts, weights, unknowns);
  solve_planes(map, equations, doubts, unknowns, before, report);
  report.shortened = shorten_directions(map, unknowns.texels);
  report.after = measure_steps(map, equations);
  measure_agreed(map, equations, doubts, weights, report);
  change.finish(report);
  state_moves(map, unknowns.texels, before);
  return report;
}

}  // namespace kiln
