// Which probes stand in for those inside geometry.
#include <algorithm>

#include "common/base/parallel.h"
#include "coordinator/scene/probes/probes.h"
#include "coordinator/scene/sight/scene_rays.h"
#include "coordinator/scene/sight/solid.h"

namespace kiln {
namespace {

constexpr int kRounds = 4;

using Sources = std::vector<ProbeSource>;

// By inactive probe: those around it on the lattice of a brick that has both, ascending.
std::vector<std::vector<uint32_t>> find_around(const ProbeLayout& layout) {
  constexpr auto kSide = static_cast<int>(kBrickSide);
  std::vector<std::vector<uint32_t>> around(layout.size());
  for (const ProbeVolume& v : layout.volumes)
    for (const ProbeBrick& b : v.bricks) {
      if (b.children) continue;
      for (int k = 0; k < static_cast<int>(kBrickProbes); ++k) {
        const uint32_t probe = b.probes[static_cast<size_t>(k)];
        if (layout.state[probe] != ProbeState::kInactive) continue;
        const int x = k % kSide, y = k / kSide % kSide, z = k / (kSide * kSide);
        for (int o = 0; o < 27; ++o) {
          const int nx = x + o % 3 - 1, ny = y + o / 3 % 3 - 1, nz = z + o / 9 - 1;
          if (o == 13 || std::min({nx, ny, nz}) < 0 || std::max({nx, ny, nz}) >= kSide) continue;
          around[probe].push_back(b.probes[static_cast<size_t>(nx + kSide * (ny + kSide * nz))]);
        }
      }
    }
  for (std::vector<uint32_t>& list : around) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return around;
}

// Makes the weights add up to 1, and one entry of those of one probe.
void normalise(Sources& sources) {
  std::sort(sources.begin(), sources.end(), [](const auto& a, const auto& b) { return a.probe < b.probe; });
  Sources merged;
  float sum = 0;
  for (const ProbeSource& s : sources) {
    if (merged.empty() || merged.back().probe != s.probe) merged.push_back({s.probe, 0});
    merged.back().weight += s.weight;
    sum += s.weight;
  }
  for (ProbeSource& s : merged) s.weight /= sum;
  sources = std::move(merged);
}

float weight_of(const ProbeLayout& layout, uint32_t a, uint32_t b) {
  const Vec3 d = layout.grid[a] - layout.grid[b];
  return 1.0f / dot(d, d);
}

}  // namespace

std::vector<std::vector<ProbeSource>> sources_of_inactive(const Scene& scene, const ProbeLayout& layout) {
  const SceneRays rays(scene);
  const Solid solid(scene);
  const std::vector<std::vector<uint32_t>> around = find_around(layout);
  std::vector<Sources> out(layout.size());
  const auto sees = [&](const Vec3& from, const Vec3& to) {
    RayHit hit;
    return !rays.closest(from, to - from, 1.0f, hit, [&](const RayHit& h) { return solid.stops(h); });
  };
  for_each_index(layout.size(), 0, [&](size_t i) {
    if (!layout.has_exit[i]) return;
    for (const uint32_t j : around[i])
      if (layout.state[j] != ProbeState::kInactive && sees(layout.exit[i], layout.place[j]))
        out[i].push_back({j, weight_of(layout, static_cast<uint32_t>(i), j)});
    if (!out[i].empty()) normalise(out[i]);
  });
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Sources> next = out;
    for (uint32_t i = 0; i < out.size(); ++i) {
      if (layout.state[i] != ProbeState::kInactive || !out[i].empty()) continue;
      for (const uint32_t j : around[i])
        for (const ProbeSource& s : out[j]) next[i].push_back({s.probe, s.weight * weight_of(layout, i, j)});
      if (!next[i].empty()) normalise(next[i]);
    }
    out = std::move(next);
  }
  return out;
}

}  // namespace kiln
