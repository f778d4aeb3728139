#include "coordinator/bake/plan/plan.h"

#include <algorithm>
#include <set>

#include "common/base/format.h"
#include "common/job/unit.h"
#include "common/responses/basis.h"

namespace kiln {
namespace {

bool is_emissive(const Record& material) {
  const Property* p = material.find("emission");
  return material.type == "unlit" ||
         (p && std::any_of(p->numbers.begin(), p->numbers.end(), [](double v) { return v > 0; }));
}

bool has_texture(const Record& record, std::string_view name) {
  const Property* p = record.find(name);
  return p && p->texture.texture >= 0;
}
// Whether the property is above 0. `absent`: the result where the file does not set it.
bool is_positive(const Record& record, std::string_view name, bool absent = false) {
  const Property* p = record.find(name);
  if (!p) return absent;
  return std::any_of(p->numbers.begin(), p->numbers.end(), [](double v) { return v > 0; });
}
bool is_lambert(const Record& m) {
  if (m.type == "unlit" || m.type == "diffuse") return true;
  return !is_positive(m, "metallic", true) && !is_positive(m, "specular", true) &&
         !is_positive(m, "clearcoat") && !is_positive(m, "sheen_color") && !is_positive(m, "transmission");
}

// Features of light transport that these materials do not need.
void find_left_out_of_materials(const Scene& scene, const BakeSettings& settings,
                                std::vector<std::string>& out) {
  const auto none = [&](const auto& has) {
    return std::none_of(scene.materials.begin(), scene.materials.end(), has);
  };
  if (settings.materials == "diffuse") {
    out.push_back(
        "--materials diffuse: every surface reflects base colour x (1 - metallic), no glossy layer is "
        "evaluated or sampled, no normal map is read, what transmits is not covered");
  } else if (none([](const Record& m) { return !is_lambert(m); })) {
    out.push_back("every surface is Lambert: no glossy layer is evaluated or sampled");
  } else if (none([](const Record& m) {
               return is_positive(m, "clearcoat") || is_positive(m, "sheen_color");
             })) {
    out.push_back("no clear coat and no sheen: no layers over the base");
  }
  if (none([](const Record& m) { return m.type != "diffuse" && is_positive(m, "transmission"); }))
    out.push_back("no glass: shadow rays carry no transmittance, paths never refract");
  if (none([](const Record& m) { return has_texture(m, "normal_texture"); }))
    out.push_back("no normal maps: no tangent frames");
  if (none([](const Record& m) {
        const Property* p = m.find("alpha_mode");
        return (p && p->word != "opaque") || (m.type == "diffuse" && is_positive(m, "transmission"));
      }))
    out.push_back("every surface is opaque: no ray runs an alpha test");
  if (scene.textures.empty()) out.push_back("no textures: none is loaded or sent");
}

std::vector<std::string> find_left_out(const Scene& scene, const BakeSettings& settings) {
  std::vector<std::string> out;
  if (!settings.quantities.light) {
    out.push_back(
        "no light asked for: no lamp, sun or sky is sampled, no ray goes beyond the first surface, nothing "
        "is "
        "denoised");
    return out;
  }
  const auto has_light = [&](std::string_view type) {
    return std::any_of(scene.lights.begin(), scene.lights.end(),
                       [&](const Record& l) { return l.type == type; });
  };
  if (!has_light("directional")) out.push_back("no directional light: no sun rays are traced");
  if (!has_light("environment")) out.push_back("no environment: rays that leave the scene carry nothing");
  for (const Record& l : scene.lights)
    if (l.type == "environment" && (!l.find("image") || l.find("image")->texture.texture < 0))
      out.push_back("the environment is constant: it needs no sampling table and no rays of its own");
  const bool lamps = has_light("point") || has_light("spot") || has_light("ies") || has_light("rectangle") ||
                     has_light("disc");
  if (!lamps && std::none_of(scene.materials.begin(), scene.materials.end(), is_emissive))
    out.push_back("no lamps and no emissive surfaces: no light tree, no sampling of local lights");
  find_left_out_of_materials(scene, settings, out);
  std::set<uint32_t> seen;
  bool shared = false;
  for (const Instance& i : scene.instances) shared |= !seen.insert(i.mesh).second;
  if (!shared) out.push_back("no mesh repeats: one flat tree, no instancing level");
  if (!settings.indirect || settings.max_bounces == 0)
    out.push_back("no indirect light asked for: paths end at the first surface");
  if (basis_of(settings).functions.empty())
    out.push_back("no directional basis asked for: only E is accumulated and sent");
  return out;
}

}  // namespace

std::string why_no_cache(const BakeSettings& settings) {
  constexpr uint32_t kEnoughBounces = 16;  // the remaining light is below the rounding of float paths
  if (!settings.cache || !settings.quantities.light) return "";
  if (!settings.indirect || settings.max_bounces == 0) return "no indirect light is asked for";
  if (settings.max_bounces < kEnoughBounces)
    return text("--max-bounces {} limits path lengths, but cached irradiance includes paths of any length",
                settings.max_bounces);
  return "";
}

Quantities job_quantities(const Scene& scene, const BakeSettings& settings) {
  Quantities out = settings.quantities;
  if (!out.light) return out;
  out.direct_apart = settings.split;
  // Without direct light in the map caches hold reflected light alone, and paths gather the rest.
  const bool has_cache = settings.cache && why_no_cache(settings).empty();
  for (const Record& l : scene.lights)
    if (const Property* bake = l.find("bake"); bake && bake->word == "indirect")
      out.all_light |= has_cache && settings.direct;
  out.cache_draws = has_cache;
  return out;
}

TexelMemory texel_memory(const BakeSettings& settings, const Quantities& quantities) {
  // Measured: 745 to 789 and 386 without the denoiser, 927 and 467 with it.
  TexelMemory memory = settings.denoise ? TexelMemory{950, 470} : TexelMemory{800, 400};
  // Sums of two replicates, what is stored of them, and their errors while a pass is judged.
  const MomentLayout all(0, quantities), light;
  if (all.planes() > light.planes()) memory.coordinator += (all.planes() - light.planes()) * (2 * 8 + 8) + 32;
  // And the latest samples, of which caches are made, and what texels share, for the denoiser. Measured: 931,
  // and with the denoiser 1,258.
  if (quantities.cache_draws) memory.coordinator += settings.denoise ? 2 * 53 + 96 : 2 * 53;
  return memory;
}

// scene_unlit.glb: up to 16 pixels a texel, compressed (the demo: 23 bytes).
constexpr uint64_t kUnlitBytesPerTexel = 32;

Plan make_plan(const Scene& scene, const Atlas& atlas, const BakeSettings& settings, unsigned threads) {
  Plan plan;
  plan.texels = atlas.texel_count();
  plan.valid_texels = atlas.sites.size();
  plan.triangles = scene.triangle_count();
  plan.charts = atlas.placements.size();
  uint64_t scene_bytes = 0;
  for (const Mesh& m : scene.meshes) {
    plan.stored_triangles += m.triangles.size();
    scene_bytes += m.positions.size() * 24 + m.triangles.size() * 16 + (m.uv[0].size() + m.uv[1].size()) * 8;
  }
  for (const Texture& t : scene.textures) scene_bytes += t.texels.size();
  const Quantities quantities = job_quantities(scene, settings);
  const uint64_t planes = MomentLayout(basis_index(settings), quantities).planes();
  const TexelMemory texel = texel_memory(settings, quantities);
  // Unsampled texels of a page still have planes.
  const uint64_t unsampled =
      (plan.texels - plan.valid_texels) * (planes + 8) * 4 * (settings.denoise ? 2 : 1);
  plan.texel_bytes = plan.valid_texels * (texel.coordinator + texel.worker) + unsampled;
  plan.coordinator_bytes = 2 * scene_bytes + plan.valid_texels * texel.coordinator + unsampled;
  // Embree: about 120 B a triangle.
  plan.worker_bytes = scene_bytes + plan.triangles * 120 + plan.valid_texels * texel.worker;
  plan.output_bytes = plan.texels * (planes + 4) * 4 + 2 * scene_bytes;
  if (settings.embed_basecolor && settings.quantities.light)
    plan.output_bytes += kUnlitBytesPerTexel * plan.texels + scene_bytes;
  const double rays_per_sample = !settings.quantities.light                      ? 1
                                 : settings.indirect && settings.max_bounces > 0 ? 8
                                                                                 : 3;
  const double second = std::max(1u, threads) * kRaysPerSecond;
  const std::string no_cache = why_no_cache(settings);
  plan.cache = settings.cache && settings.quantities.light && no_cache.empty();
  plan.least_samples = settings.least_samples(plan.valid_texels, plan.cache);
  plan.least_seconds = static_cast<double>(plan.valid_texels) * plan.least_samples * rays_per_sample / second;
  plan.most_samples = settings.most_of_each();
  plan.most_seconds = static_cast<double>(plan.valid_texels) * plan.most_samples * rays_per_sample / second;
  plan.left_out = find_left_out(scene, settings);
  if (!no_cache.empty()) plan.left_out.push_back("no irradiance cache: " + no_cache);
  return plan;
}

}  // namespace kiln
