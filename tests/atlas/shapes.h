// Meshes and scenes made in code, for tests of the atlas.
#pragma once

#include "common/atlas/atlas.h"

namespace kiln::test {

// Numbers in [0, 1) from a counter; the same on every machine.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 2654435761u + 1) {}
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  uint32_t below(uint32_t n) { return static_cast<uint32_t>(next() * n); }

 private:
  uint64_t state_;
};

enum class Uv { kNone, kUnit };

// n x n quads in the plane y = 0, `size` metres a side; TEXCOORD_1 fills the unit square.
Mesh plane(uint32_t n, float size, Uv uv);
// Every triangle has three vertices of its own: the same surface without shared indices.
Mesh unshared(const Mesh& mesh);
// Six faces; TEXCOORD_1: a 3 x 2 arrangement with gaps.
Mesh box(const Vec3& size, Uv uv);
Mesh sphere(uint32_t n, float radius);
// A ramp that winds upwards `turns` times: its projection lies on itself.
Mesh spiral(uint32_t turns, uint32_t steps);
// Triangles anywhere.
Mesh soup(uint32_t count, uint64_t seed);

Mat4x3 at(const Vec3& origin);
Instance instance(uint32_t mesh, const std::string& name, const Mat4x3& to_world = Mat4x3(1.0f));
// One instance of each mesh, ten metres apart.
Scene scene_of(std::vector<Mesh> meshes);

AtlasSettings pack_at(float texels_per_metre);
AtlasSettings file_atlas(uint32_t size);

}  // namespace kiln::test
