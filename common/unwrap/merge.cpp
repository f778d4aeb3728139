#include "common/unwrap/merge.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "common/base/parallel.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr double kMinShared = 0.05;  // of the shorter boundary

struct Pair {
  uint32_t a, b;                // charts, a < b
  std::vector<uint32_t> sides;  // of a, opposite to b
  double shared = 0, score = 0;
};

// Every pair of charts that share sides which are not sharp.
std::vector<Pair> neighbours(const Surface& surface, const std::vector<FlatChart>& charts) {
  std::vector<uint32_t> chart_of(surface.face_count(), Surface::kNone);
  for (uint32_t c = 0; c < charts.size(); ++c)
    for (uint32_t f : charts[c].faces) chart_of[f] = c;
  struct Meeting {
    uint32_t a, b, side;
  };
  std::vector<Meeting> meetings;
  std::vector<double> boundary(charts.size());
  for (uint32_t c = 0; c < charts.size(); ++c)
    for (uint32_t f : charts[c].faces)
      for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
        const uint32_t other = surface.opposite[side];
        const uint32_t d = other == Surface::kNone ? Surface::kNone : chart_of[other / 3];
        if (d != c) boundary[c] += surface.side_length(side);
        if (d != Surface::kNone && c < d) meetings.push_back({c, d, side});
      }
  std::sort(meetings.begin(), meetings.end(), [](const Meeting& x, const Meeting& y) {
    return std::array{x.a, x.b, x.side} < std::array{y.a, y.b, y.side};
  });
  std::vector<Pair> pairs;
  for (const Meeting& m : meetings) {
    if (pairs.empty() || pairs.back().a != m.a || pairs.back().b != m.b) pairs.push_back({m.a, m.b, {}});
    pairs.back().sides.push_back(m.side);
    pairs.back().shared += surface.side_length(m.side);
  }
  for (Pair& p : pairs) p.score = p.shared / std::min(boundary[p.a], boundary[p.b]);
  return pairs;
}

// The longest run among `sides` in which consecutive sides share a position.
std::vector<uint32_t> longest_run(const Surface& surface, const std::vector<uint32_t>& sides) {
  struct End {
    DVec3 at;
    uint32_t side;
  };
  std::vector<End> ends;
  for (uint32_t i = 0; i < sides.size(); ++i) {
    ends.push_back({surface.corner(sides[i]), i});
    ends.push_back({surface.corner(next_corner(sides[i])), i});
  }
  std::sort(ends.begin(), ends.end(), [](const End& p, const End& q) {
    return std::array{p.at.x, p.at.y, p.at.z, double(p.side)} <
           std::array{q.at.x, q.at.y, q.at.z, double(q.side)};
  });
  UnionFind sets(sides.size());
  for (size_t i = 1; i < ends.size(); ++i)
    if (ends[i].at == ends[i - 1].at) sets.merge(ends[i].side, ends[i - 1].side);
  std::vector<double> size(sides.size());
  for (uint32_t i = 0; i < sides.size(); ++i) size[sets.find(i)] += surface.side_length(sides[i]);
  const auto best = static_cast<uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<uint32_t> run;
  for (uint32_t i = 0; i < sides.size(); ++i)
    if (sets.find(i) == best) run.push_back(sides[i]);
  return run;
}

void glue(const Surface& surface, ChartState& state, const std::vector<uint32_t>& sides, uint8_t glued) {
  for (uint32_t side : sides) state.glued[side] = state.glued[surface.opposite[side]] = glued;
}

std::optional<FlatChart> try_pair(const Surface& surface, ChartState& state,
                                  const std::vector<FlatChart>& charts, const Pair& pair,
                                  const FlattenLimits& limits, uint64_t& work) {
  std::vector<uint32_t> faces;
  std::merge(charts[pair.a].faces.begin(), charts[pair.a].faces.end(), charts[pair.b].faces.begin(),
             charts[pair.b].faces.end(), std::back_inserter(faces));
  std::vector<uint32_t> sides = pair.sides;
  for (int attempt = 0; attempt < 2; ++attempt) {
    glue(surface, state, sides, 1);
    if (std::optional<FlatChart> flat = flatten(surface, state, faces, limits, work)) return flat;
    glue(surface, state, sides, 0);
    std::vector<uint32_t> run = longest_run(surface, sides);
    if (run.size() == sides.size()) break;
    sides = std::move(run);
  }
  return std::nullopt;
}

}  // namespace

void merge_charts(const Surface& surface, ChartState& state, std::vector<FlatChart>& charts,
                  const MergeSettings& settings, unsigned threads, uint64_t& work) {
  // Charts are known by their first face and face count: a pair that failed fails again until one changes.
  using Name = std::array<uint64_t, 4>;
  std::set<Name> failed;
  const auto name = [&](const Pair& p) {
    return Name{charts[p.a].faces[0], charts[p.a].faces.size(), charts[p.b].faces[0],
                charts[p.b].faces.size()};
  };
  while (work < settings.work) {
    std::vector<Pair> pairs = neighbours(surface, charts);
    std::erase_if(pairs, [&](const Pair& p) {
      return p.score < kMinShared || failed.count(name(p)) ||
             charts[p.a].faces.size() + charts[p.b].faces.size() > settings.max_faces;
    });
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
      return p.score != q.score ? p.score > q.score : std::array{p.a, p.b} < std::array{q.a, q.b};
    });
    std::vector<uint8_t> taken(charts.size());
    std::erase_if(pairs, [&](const Pair& p) {
      if (taken[p.a] || taken[p.b]) return true;
      return taken[p.a] = taken[p.b] = 1, false;
    });
    if (pairs.empty()) return;
    std::vector<std::optional<FlatChart>> made(pairs.size());
    std::vector<uint64_t> cost(pairs.size());
    parallel_for(
        pairs.size(),
        [&](size_t i) { made[i] = try_pair(surface, state, charts, pairs[i], settings.limits, cost[i]); },
        threads);
    work = std::accumulate(cost.begin(), cost.end(), work);
    for (size_t i = 0; i < pairs.size(); ++i) {
      if (made[i]) {
        charts[pairs[i].a] = std::move(*made[i]);
        charts[pairs[i].b].faces.clear();
      } else {
        failed.insert(name(pairs[i]));
      }
    }
    std::erase_if(charts, [](const FlatChart& c) { return c.faces.empty(); });
  }
}

}  // namespace kiln
