#include "coordinator/seams/join.h"

namespace kiln {
namespace {

struct Steps {
  double largest = 0, rms = 0;
};

// E.R E.G E.B come first in a map.
double luminance_step(const SeamEquation& e, const Lightmap& map) {
  const auto& d = map.planes.data;
  return luminance(DVec3(seam_step(e, d[0]), seam_step(e, d[1]), seam_step(e, d[2])));
}
double luminance_mean(const SeamEquation& e, const Lightmap& map) {
  const auto& d = map.planes.data;
  return luminance(DVec3(seam_mean(e, d[0]), seam_mean(e, d[1]), seam_mean(e, d[2])));
}
double relative_step(const SeamEquation& e, const Lightmap& map) {
  const double mean = luminance_mean(e, map);
  return mean > 0 ? std::abs(luminance_step(e, map)) / mean : 0;
}

Steps measure_steps(const Lightmap& map, std::span<const SeamEquation> equations) {
  Steps steps;
  for (const SeamEquation& e : equations) {
    const double relative = relative_step(e, map);
    steps.largest = std::max(steps.largest, relative);
    steps.rms += relative * relative;
  }
  if (!equations.empty()) steps.rms = std::sqrt(steps.rms / static_cast<double>(equations.size()));
  return steps;
}

std::vector<size_t> solved_planes(const Planes& planes) {
  std::vector<size_t> solved;
  for (size_t p = 0; p < planes.data.size(); ++p)
    if (planes.names[p] != "error" && planes.names[p] != "samples") solved.push_back(p);
  return solved;
}

// How far measured texels moved, in their stated errors.
class ChangeMeter {
 public:
  ChangeMeter(const Lightmap& map, const std::vector<uint32_t>& texels) : map_(map), texels_(texels) {
    for (const uint32_t t : texels) before_.push_back(value(t));
  }
  void finish(SeamReport& report) const {
    const std::vector<float>& error = map_.planes.plane("error");
    double sum = 0, squares = 0, change = 0, values = 0;
    uint64_t count = 0;
    for (size_t i = 0; i < texels_.size(); ++i) {
      const uint32_t t = texels_[i];
      if (map_.validity[t] == Validity::kFilled) continue;
      change += value(t) - before_[i];
      values += before_[i];
      if (!(error[t] > 0)) continue;
      const double moved = (value(t) - before_[i]) / double{error[t]};
      sum += std::abs(moved);
      squares += moved * moved;
      ++count;
    }
    if (count > 0) report.change_in_errors = sum / static_cast<double>(count);
    if (count > 0) report.rms_change_in_errors = std::sqrt(squares / static_cast<double>(count));
    if (values > 0) report.bias = change / values;
  }

 private:
  double value(uint32_t t) const {
    const auto& d = map_.planes.data;
    return luminance(DVec3(d[0][t], d[1][t], d[2][t]));
  }
  const Lightmap& map_;
  const std::vector<uint32_t>& texels_;
  std::vector<double> before_;
};

// Returns how many values were held at zero.
uint64_t apply(const std::vector<float>& before, const std::vector<uint32_t>& texels,
               const std::vector<double>& change, std::vector<float>& plane) {
  bool negative = false;
  for (const uint32_t t : texels) negative |= before[t] < 0;
  uint64_t held = 0;
  for (size_t i = 0; i < texels.size(); ++i) {
    const uint32_t t = texels[i];
    if (change[i] == 0) continue;
    const double moved = double{before[t]} + change[i];
    const bool hold = moved < 0 && !negative;
    held += hold;
    plane[t] = hold ? 0.0f : std::isfinite(static_cast<float>(moved)) ? static_cast<float>(moved) : before[t];
  }
  return held;
}

// Weighs up the equations that differ by too much. Returns which, empty if none does.
std::vector<uint8_t> tighten(const Lightmap& map, std::span<const SeamEquation> equations, double most_step,
                             LeastSquares& problem) {
  // A step goes down about as its weight goes up; twice that, since its neighbours give way less. Beyond the
  // bound the factor of the matrix would lose digits.
  constexpr double kMargin = 1.25, kMostWeight = 0x1p32;
  std::vector<uint8_t> changed(equations.size(), 0);
  bool any = false;
  for (size_t r = 0; r < equations.size(); ++r) {
    const double excess = relative_step(equations[r], map) / most_step;
    if (!(excess > 1) || problem.rows[r].weight > kMostWeight) continue;
    problem.rows[r].weight *= kMargin * excess;
    changed[r] = any = true;
  }
  return any ? changed : std::vector<uint8_t>{};
}

// Root of the squares by which texels have moved, in E.
double moved_by(const Lightmap& map, const std::vector<std::vector<float>>& before,
                const std::vector<size_t>& planes, std::span<const uint32_t> texels) {
  double sum = 0;
  for (size_t p = 0; p < planes.size() && planes[p] < 3; ++p)
    for (const uint32_t t : texels) {
      const double d = double{map.planes.data[planes[p]][t]} - double{before[p][t]};
      sum += d * d;
    }
  return std::sqrt(sum);
}

// Solves until no step is too large, the rounds are over, or agreement would cost too much.
void solve_in_rounds(Lightmap& map, std::span<const SeamEquation> equations, const SeamWeights& weights,
                     SeamUnknowns& unknowns, SeamReport& report) {
  const std::vector<size_t> planes = solved_planes(map.planes);
  std::vector<std::vector<double>> targets(planes.size());
  std::vector<std::vector<float>> before;
  for (size_t p = 0; p < planes.size(); ++p) {
    before.push_back(map.planes.data[planes[p]]);
    for (const SeamEquation& e : equations) targets[p].push_back(seam_step(e, before[p]));
  }
  Solution solution;
  std::vector<uint8_t> changed;
  double first_moved = 0;
  do {
    solve(unknowns.problem, targets, solution, changed);
    ++report.rounds;
    report.held_at_zero = 0;
    for (size_t p = 0; p < planes.size(); ++p)
      report.held_at_zero +=
          apply(before[p], unknowns.texels, solution.corrections[p], map.planes.data[planes[p]]);
    const double moved = moved_by(map, before, planes, unknowns.texels);
    if (report.rounds == 1) first_moved = moved;
    if (report.rounds >= weights.rounds || moved > weights.most_change * first_moved) break;
    changed = tighten(map, equations, weights.most_step, unknowns.problem);
  } while (!changed.empty());
  report.residual = solution.residual;
}

// Planes are moved one by one: where little light is, a direction may come out longer than the light. It is
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

}  // namespace

SeamReport join_seams(Lightmap& map, const Scene& scene, const Atlas& atlas, const SeamSettings& settings,
                      const SeamWeights& weights) {
  SeamReport report;
  const std::vector<BorderEdge> edges = border_edges(scene, atlas);
  std::vector<SeamStretch> stretches = coincident_stretches(edges, settings);
  const std::vector<SeamPoint> points = seam_points(edges, stretches, atlas.contacts, settings);
  const std::vector<SeamEquation> equations = seam_equations(atlas, map, points);
  report.stretches = stretches.size();
  for (const SeamStretch& s : stretches) report.metres += s.metres;
  report.equations = equations.size();
  if (equations.empty()) return report;

  SeamUnknowns unknowns = seam_unknowns(atlas, map, equations, weights);
  report.texels = unknowns.texels.size();
  const ChangeMeter change(map, unknowns.texels);
  const Steps before = measure_steps(map, equations);
  solve_in_rounds(map, equations, weights, unknowns, report);
  report.shortened = shorten_directions(map, unknowns.texels);
  const Steps after = measure_steps(map, equations);
  report.largest_before = before.largest, report.rms_before = before.rms;
  report.largest_after = after.largest, report.rms_after = after.rms;
  change.finish(report);
  return report;
}

}  // namespace kiln
