// Texels that are neighbours in the world become neighbours in the list, so a tile's rays meet the same
// part of the scene (docs/architecture.md, tiles).
#include <algorithm>

#include "common/atlas/sites.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

Vec3 world_position(const Scene& scene, const SitePick& pick) {
  const Instance& instance = scene.instances[pick.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const UVec3& v = mesh.triangles[pick.triangle];
  const Vec3& a = mesh.positions[v.x];
  const Vec3 local = a + pick.b1 * (mesh.positions[v.y] - a) + pick.b2 * (mesh.positions[v.z] - a);
  return transform_point(instance.to_world, local);
}

// Bits 0 .. 20 of v go to bits 0, 3, 6, ...
uint64_t spread_by_3(uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x001f00000000ffff;
  v = (v | v << 16) & 0x001f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  return (v | v << 2) & 0x1249249249249249;
}

struct Bounds {
  Vec3 low{0.0f};
  double steps_per_metre = 0;  // one step on every axis, so that cells are cubes
};

Bounds bounds_of(const std::vector<Vec3>& positions) {
  Bounds bounds;
  if (positions.empty()) return bounds;
  Vec3 high = bounds.low = positions[0];
  for (const Vec3& p : positions) {
    bounds.low = glm::min(bounds.low, p);
    high = glm::max(high, p);
  }
  const double extent = max_component(high - bounds.low);
  if (extent > 0) bounds.steps_per_metre = double{0x1fffff} / extent;
  return bounds;
}

uint64_t morton_code(const Bounds& bounds, const Vec3& position) {
  uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = (double{position[axis]} - bounds.low[axis]) * bounds.steps_per_metre;
    code |= spread_by_3(static_cast<uint64_t>(std::clamp(step, 0.0, double{0x1fffff}))) << axis;
  }
  return code;
}

void reorder(TexelSites& sites, const std::vector<uint32_t>& order) {
  TexelSites out;
  out.texel.reserve(sites.size());
  out.words.reserve(sites.words.size());
  out.first_word.reserve(sites.first_word.size());
  out.first_word.push_back(0);
  for (const uint32_t i : order) {
    out.texel.push_back(sites.texel[i]);
    out.words.insert(out.words.end(), sites.words.begin() + sites.first_word[i],
                     sites.words.begin() + sites.first_word[i + 1]);
    out.first_word.push_back(static_cast<uint32_t>(out.words.size()));
  }
  sites = std::move(out);
}

}  // namespace

std::vector<uint32_t> morton_order(const std::vector<Vec3>& positions, unsigned threads) {
  const Bounds bounds = bounds_of(positions);
  std::vector<std::pair<uint64_t, uint32_t>> codes(positions.size());
  for_each_index(codes.size(), threads, [&](size_t i) {
    codes[i] = {morton_code(bounds, positions[i]), static_cast<uint32_t>(i)};
  });
  std::sort(codes.begin(), codes.end());
  std::vector<uint32_t> order;
  order.reserve(codes.size());
  for (const auto& [code, i] : codes) order.push_back(i);
  return order;
}

void order_sites(const Scene& scene, Atlas& atlas, unsigned threads) {
  std::vector<Vec3> positions(atlas.sites.size());
  for_each_index(positions.size(), threads, [&](size_t i) {
    positions[i] = world_position(scene, pick_site(atlas, static_cast<uint32_t>(i), 0.0f));
  });
  // Sites arrive in order of texel, so the index breaks ties by texel.
  reorder(atlas.sites, morton_order(positions, threads));
}

}  // namespace kiln
