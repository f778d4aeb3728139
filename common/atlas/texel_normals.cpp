#include "common/atlas/texel_normals.h"

#include "common/base/check.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

Vec3 normal_at(const Scene& scene, const SitePick& at) {
  const Instance& object = scene.instances[at.instance];
  const Mesh& mesh = scene.meshes[object.mesh];
  const UVec3& v = mesh.triangles[at.triangle];
  const Vec3 n =
      mesh.normals[v.x] * (1 - at.b1 - at.b2) + mesh.normals[v.y] * at.b1 + mesh.normals[v.z] * at.b2;
  return normalize_or(transform_normal(object.to_world, n), Vec3(0.0f));
}

}  // namespace

std::vector<Vec3> texel_normals(const Scene& scene, const Atlas& atlas) {
  std::vector<Vec3> normals(atlas.texel_count(), Vec3(0.0f));
  parallel_for((atlas.sites.size() + 4095) / 4096, [&](size_t part) {
    for (size_t i = part * 4096; i < std::min(atlas.sites.size(), (part + 1) * 4096); ++i)
      normals[atlas.sites.texel[i]] = normal_at(scene, pick_site(atlas, static_cast<uint32_t>(i), 0.0f));
  });
  KILN_CHECK(atlas.owner.size() == normals.size());
  std::vector<size_t> open;
  for (size_t t = 0; t < normals.size(); ++t)
    if (atlas.owner[t] && normals[t] == Vec3(0.0f)) open.push_back(t);
  while (!open.empty()) {
    std::vector<std::pair<size_t, Vec3>> found;
    std::vector<size_t> left;
    for (const size_t t : open) {
      const auto x = static_cast<int64_t>(t % atlas.width),
                 y = static_cast<int64_t>(t / atlas.width % atlas.height);
      Vec3 sum(0.0f);
      for (int64_t dy = -1; dy <= 1; ++dy)
        for (int64_t dx = -1; dx <= 1; ++dx) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= atlas.width || y + dy >= atlas.height) continue;
          const size_t n = static_cast<size_t>(static_cast<int64_t>(t) + dy * int64_t{atlas.width} + dx);
          if (atlas.owner[n] == atlas.owner[t]) sum += normals[n];
        }
      if (sum == Vec3(0.0f))
        left.push_back(t);
      else
        found.emplace_back(t, normalize_or(sum, Vec3(0.0f)));
    }
    if (found.empty()) break;
    for (const auto& [t, n] : found) normals[t] = n;
    open = std::move(left);
  }
  return normals;
}

}  // namespace kiln
