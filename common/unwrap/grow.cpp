#include "common/unwrap/grow.h"

#include <algorithm>
#include <deque>
#include <numeric>
#include <queue>

#include "common/math/trig.h"

namespace kiln {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr double kBoundaryWeight = 0.25;  // a protruding face costs as much as a turn by 41 degrees

constexpr double kWholeCone = 0.02;  // minimum cosine to the mean normal: no overhangs

class Grower {
 public:
  Grower(const Surface& surface, ChartState& state, const GrowSettings& settings)
      : surface_(surface), state_(state), settings_(settings), chart_of_(surface.face_count(), kNone) {
    cone_ = sincos_turns(static_cast<float>(settings.cone_degrees / 360)).cos;
  }

  FaceSets run() {
    take_whole_components();
    std::vector<uint32_t> seeds;
    for (uint32_t f = 0; f < surface_.face_count(); ++f)
      if (surface_.area[f] > 0) seeds.push_back(f);
    std::sort(seeds.begin(), seeds.end(), [&](uint32_t a, uint32_t b) {
      return surface_.area[a] != surface_.area[b] ? surface_.area[a] > surface_.area[b] : a < b;
    });
    for (uint32_t seed : seeds)
      for (uint32_t at = seed; at != kNone; at = next_frontier())  // next to existing charts: fewer leftovers
        if (chart_of_[at] == kNone) grow(at);
    return std::move(charts_);
  }

 private:
  struct Candidate {
    double cost;
    uint32_t face;
    bool operator<(const Candidate& o) const { return cost != o.cost ? cost > o.cost : face > o.face; }
  };

  // A connected surface that faces one way as a whole needs no cut: a terrain, a panel.
  void take_whole_components() {
    std::vector<uint32_t> queue;
    std::vector<uint8_t> seen(surface_.face_count());
    for (uint32_t f = 0; f < surface_.face_count(); ++f) {
      if (seen[f] || !(surface_.area[f] > 0)) continue;
      queue.assign(1, f);
      seen[f] = 1;
      DVec3 sum(0.0);
      for (size_t i = 0; i < queue.size(); ++i) {
        sum += surface_.area[queue[i]] * surface_.normal[queue[i]];
        for (uint32_t side = 3 * queue[i]; side < 3 * queue[i] + 3; ++side) {
          const uint32_t other = surface_.opposite[side];
          if (other == kNone || seen[other / 3]) continue;
          seen[other / 3] = 1;
          queue.push_back(other / 3);
        }
      }
      const double least = kWholeCone * length(sum);
      if (std::any_of(queue.begin(), queue.end(),
                      [&](uint32_t i) { return dot(surface_.normal[i], sum) < least; }))
        continue;
      for (uint32_t i : queue) {
        chart_of_[i] = static_cast<uint32_t>(charts_.size());
        for (uint32_t side = 3 * i; side < 3 * i + 3; ++side)
          if (surface_.opposite[side] != kNone) state_.glued[side] = 1;
      }
      std::sort(queue.begin(), queue.end());
      charts_.push_back(queue);
    }
  }

  uint32_t next_frontier() {
    while (!frontier_.empty()) {
      const uint32_t f = frontier_.front();
      frontier_.pop_front();
      if (chart_of_[f] == kNone) return f;
    }
    return kNone;
  }

  double turn(uint32_t f) const { return dot(surface_.normal[f], sum_) / length(sum_); }

  double cost(uint32_t f, uint32_t chart) const {
    double inner = 0, all = 0;
    for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
      const double l = surface_.side_length(side);
      const uint32_t other = surface_.opposite[side];
      if (other != kNone && chart_of_[other / 3] == chart) inner += l;
      all += l;
    }
    return 1 - turn(f) + kBoundaryWeight * (all - 2 * inner) / all;
  }

  void grow(uint32_t seed) {
    const auto chart = static_cast<uint32_t>(charts_.size());
    std::vector<uint32_t>& faces = charts_.emplace_back();
    sum_ = DVec3(0.0);
    std::priority_queue<Candidate> open;
    const auto take = [&](uint32_t f) {
      chart_of_[f] = chart;
      faces.push_back(f);
      sum_ += surface_.area[f] * surface_.normal[f];
      for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
        const uint32_t other = surface_.opposite[side];
        if (other == kNone) continue;
        if (chart_of_[other / 3] == chart)
          state_.glued[side] = state_.glued[other] = 1;
        else if (chart_of_[other / 3] == kNone)
          open.push({cost(other / 3, chart), other / 3});
      }
    };
    take(seed);
    while (!open.empty() && faces.size() < settings_.max_faces) {
      const Candidate next = open.top();
      open.pop();
      if (chart_of_[next.face] != kNone) continue;
      if (turn(next.face) < cone_)
        frontier_.push_back(next.face);
      else
        take(next.face);
    }
    for (; !open.empty(); open.pop()) frontier_.push_back(open.top().face);
    std::sort(faces.begin(), faces.end());
  }

  const Surface& surface_;
  ChartState& state_;
  GrowSettings settings_;
  double cone_;
  std::vector<uint32_t> chart_of_;
  FaceSets charts_;
  std::deque<uint32_t> frontier_;
  DVec3 sum_{0.0};  // area-weighted normals of the chart in progress
};

}  // namespace

FaceSets grow_charts(const Surface& surface, ChartState& state, const GrowSettings& settings) {
  return Grower(surface, state, settings).run();
}

FaceSets split_chart(const Surface& surface, ChartState& state, const std::vector<uint32_t>& faces) {
  for (uint32_t i = 0; i < faces.size(); ++i) state.slot[faces[i]] = i;
  // Breadth first from `starts`; label of each face by the start it is nearest to.
  const auto spread = [&](std::vector<uint32_t> queue, std::vector<uint32_t>& label) {
    label.assign(faces.size(), kNone);
    for (uint32_t i = 0; i < queue.size(); ++i) label[queue[i]] = i;
    for (size_t i = 0; i < queue.size(); ++i)
      for (uint32_t side = 3 * faces[queue[i]]; side < 3 * faces[queue[i]] + 3; ++side) {
        if (!state.glued[side]) continue;
        const uint32_t other = state.slot[surface.opposite[side] / 3];
        if (label[other] != kNone) continue;
        label[other] = label[queue[i]];
        queue.push_back(other);
      }
    return queue.back();
  };
  std::vector<uint32_t> label;
  const uint32_t far = spread({0}, label);
  const uint32_t farther = spread({far}, label);
  spread({far, farther}, label);
  for (uint32_t i = 0; i < faces.size(); ++i)
    for (uint32_t side = 3 * faces[i]; side < 3 * faces[i] + 3; ++side)
      if (state.glued[side] && label[state.slot[surface.opposite[side] / 3]] != label[i])
        state.glued[side] = 0;
  for (uint32_t i = 0; i < faces.size(); ++i)  // the other halves of those sides
    for (uint32_t side = 3 * faces[i]; side < 3 * faces[i] + 3; ++side)
      if (state.glued[side] && !state.glued[surface.opposite[side]]) state.glued[side] = 0;
  FaceSets parts(2);
  for (uint32_t i = 0; i < faces.size(); ++i) parts[label[i] == 1].push_back(faces[i]);
  if (parts[1].empty()) parts.pop_back();
  return parts;
}

}  // namespace kiln
