#include "coordinator/scene/import/materials.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/scene/import/layers.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
using Role = TextureRequest::Role;

std::string alpha_word(const GltfMaterial& material, MaterialReader& reader) {
  if (material.alpha_mode == "MASK") return "mask";
  if (material.alpha_mode == "BLEND") return "blend";
  if (material.alpha_mode != "OPAQUE")
    reader.note(Kind::kWarning,
                text("alpha mode '{}' does not exist: taken as OPAQUE until it is MASK or BLEND",
                     material.alpha_mode));
  return "opaque";
}

// KHR_materials_pbrSpecularGlossiness as a dielectric: its specular colour is lost.
void read_specular_glossiness(const GltfValue& extension, GltfMaterial& material) {
  const auto diffuse = extension.numbers("diffuseFactor", 4);
  material.base_color = {1, 1, 1, 1};
  if (diffuse) std::copy_n(diffuse->begin(), 4, material.base_color.begin());
  material.metallic = 0;
  material.roughness = 1 - extension.number_or("glossinessFactor", 1);
  material.metallic_roughness_texture = {};
  material.base_color_texture = texture_info(extension, "diffuseTexture");
}

void put_base_color(const GltfMaterial& material, MaterialReader& reader, Record& record) {
  std::vector<double> factor(material.base_color.begin(), material.base_color.end());
  for (double& f : factor) f = reader.clamped("baseColorFactor", f, 0, 1);
  const std::string alpha = alpha_word(material, reader);
  put_numbers(record, "base_color", factor);
  reader.texture("base_color_texture", material.base_color_texture, Role::kColor, alpha != "opaque");
  put_word(record, "alpha_mode", alpha);
  put_numbers(record, "alpha_cutoff", {material.alpha_cutoff});
  put_numbers(record, "double_sided", {material.double_sided ? 1.0 : 0.0});
}

void put_surface(const GltfMaterial& material, MaterialReader& reader, Record& record) {
  const double metallic = reader.clamped("metallicFactor", material.metallic, 0, 1);
  const double roughness = reader.clamped("roughnessFactor", material.roughness, 0, 1);
  put_numbers(record, "metallic", {metallic});
  put_numbers(record, "roughness", {roughness});
  if (metallic > 0 || roughness > 0)
    reader.texture("metallic_roughness_texture", material.metallic_roughness_texture, Role::kFactors);
}

// What `--materials diffuse` keeps.
void put_diffuse(const GltfMaterial& material, MaterialReader& reader) {
  const double metallic = reader.clamped("metallicFactor", material.metallic, 0, 1);
  reader.numbers("metallic", {metallic});
  if (metallic > 0)
    reader.texture("metallic_roughness_texture", material.metallic_roughness_texture, Role::kFactors);
  if (metallic == 1 && material.metallic_roughness_texture.texture < 0)
    reader.note(Kind::kApproximated, "metal reflects nothing with --materials diffuse");
  put_plain_transmission(material, reader);
}

void put_emission(const GltfMaterial& material, MaterialReader& reader, Record& record) {
  const GltfValue* extension = find_extension(material.extensions, "KHR_materials_emissive_strength");
  const double strength = extension ? extension->number_or("emissiveStrength", 1) : 1;
  std::vector<double> emission;
  for (const double f : material.emissive) {
    const double radiance = f * strength;
    if (!(radiance >= 0) || !std::isfinite(static_cast<float>(radiance)))
      reader.note(Kind::kWarning,
                  text("its emission {} is not a valid radiance: taken as 0 until it is a number from 0 on",
                       radiance));
    emission.push_back(radiance >= 0 && std::isfinite(static_cast<float>(radiance)) ? radiance : 0);
  }
  put_numbers(record, "emission", emission);
  if (emits(record)) reader.texture("emission_texture", material.emissive_texture, Role::kColor);
}

void put_normal_map(const GltfMaterial& material, MaterialReader& reader) {
  if (material.normal_texture.texture < 0 || material.normal_scale == 0) return;
  reader.texture("normal_texture", material.normal_texture, Role::kNormal);
  if (material.normal_scale != 1) reader.numbers("normal_scale", {material.normal_scale});
}

}  // namespace

Record read_material(const ImportContext& context, int index, TextureSet& textures, ImportNotes& notes) {
  GltfMaterial material;  // without an index: glTF's default, section 3.9.6
  material.name = "default";
  material.base_color = {1, 1, 1, 1};
  material.emissive = {0, 0, 0};
  material.alpha_mode = "OPAQUE";
  if (index >= 0) material = context.model.materials[static_cast<size_t>(index)];
  const std::string who =
      index < 0 ? "default material" : element("material", static_cast<size_t>(index), material.name);
  Record record;
  record.name = material.name.empty() ? text("material {}", index) : material.name;
  MaterialReader reader(record, who, textures, notes);
  if (const GltfValue* extension = find_extension(material.extensions, "KHR_materials_pbrSpecularGlossiness"))
    read_specular_glossiness(*extension, material);
  const bool unlit = material.extensions.count("KHR_materials_unlit") != 0;
  const bool diffuse = context.settings.materials == "diffuse";
  record.type = unlit ? "unlit" : diffuse ? "diffuse" : "metallic_roughness";
  put_base_color(material, reader, record);
  if (unlit) return record;
  if (diffuse) {
    put_diffuse(material, reader);
    put_emission(material, reader, record);
    return record;
  }
  put_surface(material, reader, record);
  put_emission(material, reader, record);
  put_normal_map(material, reader);
  put_layers(material, reader);
  return record;
}

void resolve_textures(Record& material, const TextureSet& textures) {
  std::erase_if(material.properties, [&](Property& p) {
    if (p.texture.texture < 0) return false;
    p.texture.texture = textures.index_of(p.texture.texture);
    return p.texture.texture < 0;
  });
}

bool uses_uv_set(const Record& material, uint32_t set) {
  return std::any_of(material.properties.begin(), material.properties.end(),
                     [&](const Property& p) { return p.texture.texture >= 0 && p.texture.uv_set == set; });
}

bool emits(const Record& material) {
  const Property* emission = material.find("emission");
  return emission &&
         std::any_of(emission->numbers.begin(), emission->numbers.end(), [](double e) { return e > 0; });
}

}  // namespace kiln
