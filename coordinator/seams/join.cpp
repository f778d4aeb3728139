#include "coordinator/seams/join.h"

namespace kiln {
namespace {

struct Steps {
  double largest = 0, rms = 0;
};

double luminance_of(const double (&rgb)[3]) {
  return luminance(DVec3(rgb[0], rgb[1], rgb[2]));
}

Steps measure_steps(const Lightmap& map, std::span<const SeamEquation> equations) {
  Steps steps;
  for (const SeamEquation& e : equations) {
    double step[3], mean[3];
    for (size_t c = 0; c < 3; ++c) {  // E.R E.G E.B come first
      step[c] = seam_step(e, map.planes.data[c]);
      mean[c] = seam_mean(e, map.planes.data[c]);
    }
    const double local = luminance_of(mean);
    if (!(local > 0)) continue;
    const double relative = std::abs(luminance_of(step)) / local;
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

void apply(std::vector<float>& plane, const std::vector<uint32_t>& texels, const std::vector<double>& change,
           SeamReport& report) {
  bool negative = false;
  for (const uint32_t t : texels) negative |= plane[t] < 0;
  for (size_t i = 0; i < texels.size(); ++i) {
    if (change[i] == 0) continue;
    float& value = plane[texels[i]];
    const double moved = double{value} + change[i];
    if (moved < 0 && !negative) {
      value = 0;
      ++report.held_at_zero;
    } else if (std::isfinite(static_cast<float>(moved))) {
      value = static_cast<float>(moved);
    }
  }
}

}  // namespace

SeamReport join_seams(Lightmap& map, const Scene& scene, const Atlas& atlas, const SeamSettings& settings,
                      const SeamWeights& weights) {
  SeamReport report;
  const std::vector<BorderEdge> edges = border_edges(scene, atlas);
  std::vector<Stretch> stretches = coincident_stretches(edges, settings);
  const std::vector<SeamPoint> points = seam_points(edges, stretches, settings);
  const std::vector<SeamEquation> equations = seam_equations(atlas, map, points);
  report.stretches = stretches.size();
  for (const Stretch& s : stretches) report.metres += s.metres;
  report.equations = equations.size();
  if (equations.empty()) return report;

  const SeamUnknowns unknowns = seam_unknowns(atlas, map, equations, weights);
  report.texels = unknowns.texels.size();
  const ChangeMeter change(map, unknowns.texels);
  const Steps before = measure_steps(map, equations);
  const std::vector<size_t> planes = solved_planes(map.planes);
  std::vector<std::vector<double>> targets(planes.size());
  for (size_t p = 0; p < planes.size(); ++p)
    for (const SeamEquation& e : equations) targets[p].push_back(seam_step(e, map.planes.data[planes[p]]));
  const Solution solution = solve(unknowns.problem, targets);
  for (size_t p = 0; p < planes.size(); ++p)
    apply(map.planes.data[planes[p]], unknowns.texels, solution.corrections[p], report);

  const Steps after = measure_steps(map, equations);
  report.largest_before = before.largest, report.rms_before = before.rms;
  report.largest_after = after.largest, report.rms_after = after.rms;
  report.residual = solution.residual;
  change.finish(report);
  return report;
}

}  // namespace kiln
