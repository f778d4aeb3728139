#include "tests/leaks/leak_bake.h"

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/post/stage.h"
#include "worker/bake/baker.h"

namespace kiln::test {

LeakBake bake_map(Scene scene, AtlasSettings settings, uint32_t samples, uint64_t seed) {
  LeakBake b;
  auto atlas = build_atlas(scene, settings);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  b.atlas = *atlas;
  b.scene = scene;
  TransportSettings transport;
  transport.seed = seed;
  auto baker = Baker::create(std::move(scene), std::move(*atlas), transport, 2);
  if (!baker) throw std::runtime_error(baker.error().message);
  const auto sites = static_cast<uint32_t>(b.atlas.sites.size());
  std::vector<WorkUnit> units;
  for (uint32_t site = 0; site < sites; ++site) {
    if (units.empty() || units.back().sites.size() == 64) units.push_back({units.size(), 0, samples, {}});
    units.back().sites.push_back(site);
  }
  std::vector<UnitResult> results(units.size());
  parallel_for(units.size(), [&](size_t i) { results[i] = *(*baker)->bake(units[i]); });
  Accumulator sums(sites, MomentLayout(transport.basis));
  for (size_t i = 0; i < units.size(); ++i) KILN_CHECK(sums.add(units[i], results[i]).has_value());
  b.map = sums.resolve(b.atlas);
  const BakeSettings defaults;
  for (const PostStage& stage : post_stages()) stage.run(b.map, {b.scene, b.atlas, defaults});
  return b;
}

double LeakBake::bilinear(const AtlasPlace& place) const {
  const double x = place.texels.x - 0.5, y = place.texels.y - 0.5;
  const double fx = std::floor(x), fy = std::floor(y);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const double tx = std::clamp(fx + (k & 1), 0.0, atlas.width - 1.0),
                 ty = std::clamp(fy + (k >> 1), 0.0, atlas.height - 1.0);
    const size_t t =
        (size_t{place.page} * atlas.height + static_cast<size_t>(ty)) * atlas.width + static_cast<size_t>(tx);
    const double wx = k & 1 ? x - fx : 1 - (x - fx), wy = k >> 1 ? y - fy : 1 - (y - fy);
    sum += wx * wy * luminance(Vec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t]));
  }
  return sum;
}

void for_each_point(const LeakBake& b, uint32_t steps,
                    const std::function<void(const Vec3&, const Vec3&, double)>& visit) {
  const AtlasLookup lookup(b.atlas);
  for (uint32_t i = 0; i < b.scene.instances.size(); ++i) {
    const Instance& in = b.scene.instances[i];
    const Mesh& mesh = b.scene.meshes[in.mesh];
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = transform_point(in.to_world, mesh.positions[mesh.triangles[t][k]]);
      const Vec3 n = normalize_or(cross(p[1] - p[0], p[2] - p[0]), Vec3(0, 1, 0));
      for (uint32_t y = 0; y < steps; ++y)
        for (uint32_t x = 0; x + y < steps; ++x) {
          const double b1 = (x + 0.4) / steps, b2 = (y + 0.4) / steps;
          const Vec3 at =
              p[0] + static_cast<float>(b1) * (p[1] - p[0]) + static_cast<float>(b2) * (p[2] - p[0]);
          visit(at, n, b.bilinear(lookup.at(i, t, b1, b2)));
        }
    }
  }
}

}  // namespace kiln::test
