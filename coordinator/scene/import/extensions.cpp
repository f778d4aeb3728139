#include "coordinator/scene/import/extensions.h"

#include <algorithm>
#include <set>

#include "common/base/format.h"
#include "coordinator/scene/document/variants.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;

struct KnownExtension {
  const char* name;
  Kind kind;  // kBaked and kApproximated may be required, kIgnored too: it does not affect the bake
  const char* treatment;
};

constexpr KnownExtension kKnown[] = {
    {"KHR_mesh_quantization", Kind::kBaked, "read"},
    {"KHR_texture_transform", Kind::kBaked, "read"},
    {"KHR_lights_punctual", Kind::kBaked, "read"},
    {"EXT_lights_ies", Kind::kBaked, "profiles of type C photometry are read"},
    {"KHR_materials_emissive_strength", Kind::kBaked, "read"},
    {"KHR_materials_unlit", Kind::kBaked, "read"},
    {"EXT_mesh_gpu_instancing", Kind::kBaked, "read"},
    {"MSFT_lod", Kind::kBaked,
     "one level of a node is baked, the others get its lightmap; levels of materials are left out"},
    {"EXT_texture_webp", Kind::kBaked, "read"},
    {"EXT_texture_avif", Kind::kBaked, "read"},
    {"KHR_node_visibility", Kind::kBaked, "nodes that are not visible are left out, with what is below them"},
    {"EXT_lights_image_based", Kind::kApproximated,
     "the cube is resampled to a latitude-longitude image, its irradiance coefficients are not used"},
    {"KHR_materials_ior", Kind::kBaked, "read"},
    {"KHR_materials_specular", Kind::kBaked, "read"},
    {"KHR_materials_transmission", Kind::kApproximated,
     "straight tinted transmission; no refraction and no rough scattering"},
    {"KHR_materials_volume", Kind::kApproximated,
     "attenuation is read, for the way through the mesh; the thickness texture is not"},
    {"KHR_materials_clearcoat", Kind::kApproximated,
     "the coat reflects and dims; its normal map and reflections between coat and base are left out"},
    {"KHR_materials_sheen", Kind::kApproximated,
     "a diffuse-like lobe of the same reflectance at every angle approximates its fibres"},
    {"KHR_materials_anisotropy", Kind::kApproximated, "left out: its roughness counts in both directions"},
    {"KHR_materials_iridescence", Kind::kApproximated, "left out: the layer reflects without interference"},
    {"KHR_materials_dispersion", Kind::kApproximated, "left out: nothing is refracted"},
    {"KHR_materials_diffuse_transmission", Kind::kApproximated,
     "left out: the surface lets no light through"},
    {"KHR_materials_pbrSpecularGlossiness", Kind::kApproximated,
     "its diffuse colour and glossiness are taken for base colour and roughness of a dielectric"},
    {"KILN_lightmap", Kind::kIgnored, "the lightmap of an earlier bake; scene.glb will carry the new one"},
    {"MOZ_lightmap", Kind::kIgnored, "the lightmap of an earlier bake; scene.glb will carry the new one"},
    {"EPIC_lightmap_textures", Kind::kIgnored,
     "the lightmap of an earlier bake; scene.glb will carry the new one"},
    {"MX_lightmap", Kind::kIgnored, "the lightmap of an earlier bake; scene.glb will carry the new one"},
    {"KILN_probes", Kind::kIgnored, "the probes of an earlier bake"},
    {"KHR_materials_variants", Kind::kBaked, "read"},
    {"KHR_animation_pointer", Kind::kIgnored, "the scene at rest is baked"},
    {"KHR_xmp_json_ld", Kind::kIgnored, "it is about the file, not the scene"},
};

}  // namespace

Status check_extensions(const ImportContext& context, ImportNotes& notes) {
  const auto find = [](const std::string& name) {
    return std::find_if(std::begin(kKnown), std::end(kKnown),
                        [&](const KnownExtension& k) { return k.name == name; });
  };
  std::string refused;
  for (const std::string& name : context.model.extensions_required)
    if (find(name) == std::end(kKnown)) refused += (refused.empty() ? "" : ", ") + name;
  if (!refused.empty()) return context.bad(text("it requires what is not supported: {}", refused));
  for (const std::string& name : context.document.expanded)
    add_note(notes, Kind::kBaked, text("{}: read; scene.glb has the same data without it", name));
  const std::set<std::string> used(context.model.extensions_used.begin(),
                                   context.model.extensions_used.end());
  for (const std::string& name : used) {
    const auto known = find(name);
    if (known != std::end(kKnown))
      add_note(notes, known->kind, text("{}: {}", name, known->treatment));
    else
      add_note(notes, Kind::kIgnored,
               text("{}: not supported; the file does not require it, so it is left out", name));
  }
  if (!context.document.variants.empty() && context.settings.variant.empty())
    add_note(notes, Kind::kNote,
             text("the file's own materials are baked; --variant bakes those of a variant: {}",
                  listed_variants(context.document.variants)));
  if (context.model.animated)
    add_note(notes, Kind::kIgnored, "animations are left out: the scene at rest is baked");
  return {};
}

}  // namespace kiln
