// Probe volumes: boxes filled with bricks of probes, which are finer near surfaces.
//
// A brick is 4 x 4 x 4 probes, so 3 cells a side. Where it is refined, 8 bricks of half the spacing take its
// place, and all of its probes are among theirs. (Bricks of 4^3 probes as in Unity's adaptive volumes, which
// refine by 3; halving gives twice as many steps between the finest and the coarsest spacing.) Neighbours
// differ by one level at most, also across edges and corners.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// What is asked for. World axes, metres.
struct ProbeBox {
  std::string name;
  DVec3 low{0.0}, high{0.0};
  double spacing = 1;      // of the finest bricks
  double max_spacing = 1;  // of the coarsest, rounded down to spacing x 2^n
  bool visibility = false;
  std::optional<uint32_t> node;  // of the scene's file, that asks for it
};

// What is wrong with a box, in a sentence; empty: nothing.
std::string fault_of(const ProbeBox& box);

constexpr uint32_t kBrickSide = 4, kBrickCells = kBrickSide - 1;
constexpr uint32_t kBrickProbes = kBrickSide * kBrickSide * kBrickSide;
constexpr uint32_t kMaxProbeLevels = 10;

struct ProbeBrick {
  UVec3 corner{0};        // in finest spacings from the volume's corner
  uint32_t level = 0;     // its spacing is the finest x 2^level
  uint32_t parent = 0;    // index of the brick it is a part of; its own index: none
  uint32_t children = 0;  // index of the first of 8, x fastest; 0: it is not refined
  // Neighbours of a larger spacing: bit (x + 1) + 3 (y + 1) + 9 (z + 1) for the direction (x, y, z).
  uint32_t coarser = 0;
  std::array<uint32_t, kBrickProbes> probes{};  // x fastest; indices into all probes of the bake
  uint32_t size() const { return kBrickCells << level; }
};

struct ProbeVolume {
  std::string name;
  DVec3 low{0.0};                  // corner of the first brick
  double spacing = 1;              // the finest in use
  UVec3 roots{1};                  // bricks of the coarsest level a side
  uint32_t levels = 1;             // number of spacings
  bool visibility = false;         // octahedral E and distances are there
  std::optional<uint32_t> node;    // that asked for it
  std::vector<ProbeBrick> bricks;  // the coarsest first, x fastest; then children, eight together
  uint32_t root_size() const { return kBrickCells << (levels - 1); }
  DVec3 high() const { return low + DVec3(roots * root_size()) * spacing; }
  DVec3 place(const UVec3& point) const { return low + DVec3(point) * spacing; }
  double spacing_of(const ProbeBrick& brick) const {
    return spacing * static_cast<double>(1u << brick.level);
  }
};

// The finest brick at a point given in finest spacings from the corner, inside the volume.
inline uint32_t find_brick(const ProbeVolume& volume, const DVec3& at) {
  const double root = volume.root_size();
  UVec3 cell;
  for (int k = 0; k < 3; ++k)
    cell[k] = std::min(static_cast<uint32_t>(std::max(0.0, at[k] / root)), volume.roots[k] - 1);
  uint32_t index = cell.x + volume.roots.x * (cell.y + volume.roots.y * cell.z);
  while (const uint32_t children = volume.bricks[index].children) {
    const ProbeBrick& first = volume.bricks[children];
    const double half = first.size();
    uint32_t octant = 0;
    for (int k = 0; k < 3; ++k) octant |= uint32_t{at[k] >= first.corner[k] + half} << k;
    index = children + octant;
  }
  return index;
}

// What a place is found to be, in probes.json and the master's plane "state".
enum class ProbeState : uint8_t {
  kActive = 0,    // at its place in the grid
  kMoved = 1,     // away from a surface, or out of one
  kInactive = 2,  // inside geometry; no light of its own
};

}  // namespace kiln
