#include "coordinator/scene/import/texture_density.h"

#include <cmath>

#include "common/base/format.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

// A texel's samples start all over it and spread over the hemisphere, so the bake itself averages detail
// finer than its edge. docs/performance.md has rates.
constexpr double kTexelsPerLightmapTexel = 4;

double cross2(const Vec2& a, const Vec2& b) {
  return double{a.x} * b.y - double{a.y} * b.x;
}

struct Areas {
  double world = 0;
  double uv[2] = {0, 0};
};

Areas areas_of(const Mesh& m, const Mat4x3& to_world) {
  Areas a;
  for (const UVec3& t : m.triangles) {
    const Vec3 e1 = transform_vector(to_world, m.positions[t.y] - m.positions[t.x]);
    const Vec3 e2 = transform_vector(to_world, m.positions[t.z] - m.positions[t.x]);
    a.world += 0.5 * double{length(cross(e1, e2))};
    for (int set = 0; set < 2; ++set) {
      const auto& uv = m.uv[set];
      if (!uv.empty()) a.uv[set] += 0.5 * std::abs(cross2(uv[t.y] - uv[t.x], uv[t.z] - uv[t.x]));
    }
  }
  return a;
}

// Texels per metre of the lightmap; of the finer layout if it is not decided yet.
double lightmap_density(const Scene& scene, const BakeSettings& settings, double factor,
                        const std::vector<Areas>& areas) {
  double atlas_area = 0;
  for (size_t i = 0; i < areas.size(); ++i)
    if (!scene.meshes[scene.instances[i].mesh].uv[1].empty()) atlas_area += areas[i].world;
  const double atlas =
      atlas_area > 0 ? std::sqrt(static_cast<double>(settings.width) * settings.height / atlas_area) : 0.0;
  const double packed = factor * settings.texels_per_metre;
  if (settings.layout == "pack") return packed;
  if (settings.layout == "atlas") return atlas;
  return std::max(atlas, packed);
}

// Texels per metre of each texture where it is coarsest; 0: do not reduce.
std::vector<double> texture_densities(const Scene& scene, const std::vector<Areas>& areas) {
  std::vector<double> density(scene.textures.size(), INFINITY);
  for (size_t i = 0; i < areas.size(); ++i) {
    const Record& material = scene.materials[scene.instances[i].material];
    const Property* mode = material.find("alpha_mode");
    const bool cuts = mode && mode->word != "opaque";
    for (const Property& p : material.properties) {
      if (p.texture.texture < 0) continue;
      const auto index = static_cast<size_t>(p.texture.texture);
      const Texture& t = scene.textures[index];
      const float* m = p.texture.m;
      const double stretch = std::abs(double{m[0]} * m[4] - double{m[1]} * m[3]);
      const double texels = areas[i].uv[p.texture.uv_set] * stretch * t.width * t.height;
      const bool keep = t.nearest || (cuts && p.name == "base_color_texture");
      density[index] = std::min(density[index], keep ? 0.0 : std::sqrt(texels / areas[i].world));
    }
  }
  return density;
}

}  // namespace

void reduce_to_density(Scene& scene, const BakeSettings& settings, double factor, ImportNotes& notes) {
  std::vector<Areas> areas;
  for (const Instance& i : scene.instances) areas.push_back(areas_of(scene.meshes[i.mesh], i.to_world));
  const double wanted = kTexelsPerLightmapTexel * lightmap_density(scene, settings, factor, areas);
  const std::vector<double> density = texture_densities(scene, areas);
  std::vector<uint8_t> reduced(scene.textures.size(), 0);
  parallel_for(scene.textures.size(), [&](size_t i) {
    Texture& t = scene.textures[i];
    uint32_t size = std::max(t.width, t.height);
    if (!std::isfinite(density[i])) return;
    for (double d = density[i]; d >= 2 * wanted && size > 1; d /= 2) size = (size + 1) / 2;
    reduced[i] = size < std::max(t.width, t.height);
    if (reduced[i]) t = reduce_texture(std::move(t), size);
  });
  Finding names;
  for (size_t i = 0; i < reduced.size(); ++i)
    if (reduced[i]) names.add(text("'{}'", scene.textures[i].name));
  if (!names.empty())
    add_note(notes, ImportNote::Kind::kBaked,
             text("finer than {:.0f} texels a metre, which this lightmap cannot resolve in reflected light: "
                  "reduced are {}",
                  wanted, names.list("texture", "textures")));
}

}  // namespace kiln
