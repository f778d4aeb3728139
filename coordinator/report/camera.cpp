#include <algorithm>

#include "coordinator/look/surface_look.h"
#include "coordinator/report/preview.h"
#include "coordinator/report/raster.h"

namespace kiln {
namespace {

Camera look_from(const Vec3& eye, const Vec3& forward) {
  Camera c;
  const Vec3 z = normalize_or(-forward, Vec3(0, 0, 1));
  const Vec3 x = normalize_or(cross(Vec3(0, 1, 0), z), Vec3(1, 0, 0));
  c.to_world = Mat4x3(x, cross(z, x), z, eye);
  c.vertical_fov = 1.0f;
  c.name = "chosen";
  return c;
}

// Much of the lightmap, seen from its front, lit, not pressed against the lens.
double score(const SurfaceLook& look, const View& view, float radius) {
  size_t front = 0, back = 0, lit = 0, near = 0;
  std::vector<size_t> seen;
  for (const Fragment& f : view.fragments) {
    if (f.inverse_depth == 0) continue;
    if (f.back) {
      ++back;
      continue;
    }
    ++front;
    near += f.inverse_depth * radius > 20.0f;
    Vec3 e;
    lit += look.irradiance(f, e) && luminance(e) > 0;
    seen.push_back(look.texel(f));
  }
  std::sort(seen.begin(), seen.end());
  const double texels = static_cast<double>(std::unique(seen.begin(), seen.end()) - seen.begin());
  const double all = static_cast<double>(view.fragments.size());
  const double share = front / all;
  return std::sqrt(texels) * share * (lit / all + 0.1) * std::max(0.0, 1.0 - 3.0 * back / all) *
         std::max(0.05, 1.0 - 2.0 * near / all);
}

}  // namespace

Camera choose_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map) {
  if (imported.camera) return *imported.camera;
  const Scene& scene = imported.scene;
  // Bounds that ignore the outermost hundredth on each side: a sky dome is not where to stand.
  std::vector<float> axis[3];
  for (const Instance& i : scene.instances)
    for (const Vec3& p : scene.meshes[i.mesh].positions)
      for (int k = 0; k < 3; ++k) axis[k].push_back(transform_point(i.to_world, p)[k]);
  Vec3 low(0.0f), high(0.0f);
  for (int k = 0; k < 3; ++k) {
    std::sort(axis[k].begin(), axis[k].end());
    low[k] = axis[k][axis[k].size() / 100];
    high[k] = axis[k][axis[k].size() - 1 - axis[k].size() / 100];
  }
  const Vec3 centre = 0.5f * (low + high), half = 0.5f * (high - low);
  const float radius = std::max(1e-3f, length(half));

  std::vector<Camera> candidates;
  for (float x : {-0.6f, 0.0f, 0.6f})
    for (float y : {-0.5f, 0.1f})
      for (float z : {-0.6f, 0.0f, 0.6f})
        for (int turn = 0; turn < 8; ++turn) {
          const float a = 0.785398f * static_cast<float>(turn);
          candidates.push_back(
              look_from(centre + half * Vec3(x, y, z), Vec3(std::cos(a), -0.15f, std::sin(a))));
        }
  for (float x : {-0.92f, 0.0f, 0.92f})  // from walls and corners across the room
    for (float y : {-0.3f, 0.5f})
      for (float z : {-0.92f, 0.0f, 0.92f})
        if (x != 0 || z != 0)
          candidates.push_back(look_from(centre + half * Vec3(x, y, z), half * Vec3(-x, -y, -z)));
  for (int turn = 0; turn < 8; ++turn) {
    const float a = 0.785398f * static_cast<float>(turn);
    const Vec3 out(std::cos(a), 0.6f, std::sin(a));
    candidates.push_back(look_from(centre + out * (1.6f * radius), -out));
  }
  const SurfaceLook look(scene, atlas, map);
  size_t best = 0;
  double best_score = -1;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const View view = rasterise(scene, candidates[i], 96, 54, [&](const Fragment& f) {
      return f.back ? !look.double_sided(f.instance) || look.visible(f) : look.visible(f);
    });
    const double s = score(look, view, radius);
    if (s > best_score) best_score = s, best = i;
  }
  return candidates[best];
}

}  // namespace kiln
