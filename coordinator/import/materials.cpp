#include "coordinator/import/materials.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/import/records.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
using Role = TextureRequest::Role;

const GltfValue* find_extension(const GltfExtensions& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() ? nullptr : &it->second;
}

// KHR_texture_transform: translation * rotation * scale, uv as a column.
void apply_transform(const GltfValue& transform, TextureUse& use, int& uv_set) {
  const auto offset = transform.numbers("offset", 2), scale = transform.numbers("scale", 2);
  const double angle = transform.number_or("rotation", 0);
  const double sx = scale ? (*scale)[0] : 1, sy = scale ? (*scale)[1] : 1;
  const double m[6] = {std::cos(angle) * sx,  std::sin(angle) * sy, offset ? (*offset)[0] : 0,
                       -std::sin(angle) * sx, std::cos(angle) * sy, offset ? (*offset)[1] : 0};
  for (int i = 0; i < 6; ++i) use.m[i] = static_cast<float>(m[i]);
  if (transform.index("texCoord") >= 0) uv_set = transform.index("texCoord");
}

class MaterialReader {
 public:
  MaterialReader(Record& record, std::string who, TextureSet& textures, ImportNotes& notes)
      : record_(record), who_(std::move(who)), textures_(textures), notes_(notes) {}

  void texture(const char* property, const GltfTextureInfo& info, Role role, bool keep_alpha) {
    if (info.texture < 0) return;
    TextureUse use;
    int uv_set = info.uv_set;
    if (const GltfValue* transform = find_extension(info.extensions, "KHR_texture_transform"))
      apply_transform(*transform, use, uv_set);
    if (uv_set < 0 || uv_set > 1) {
      note(Kind::kWarning, text("{} uses TEXCOORD_{}, only 0 and 1 are read; its factor is used without it",
                                property, uv_set));
      return;
    }
    if (!std::all_of(std::begin(use.m), std::end(use.m), [](float v) { return std::isfinite(v); })) {
      note(Kind::kWarning,
           text("the transform of {} is not finite; its factor is used without it", property));
      return;
    }
    use.uv_set = static_cast<uint32_t>(uv_set);
    use.texture = textures_.add({info.texture, role, keep_alpha});
    put_texture(record_, property, use);
  }
  // A factor within its range; what lies outside is clamped, and said.
  double clamped(const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return value;
    note(Kind::kApproximated, text("{} {} is outside of {} to {} and clamped", name, value, low, high));
    return value < low ? low : high;
  }
  void note(Kind kind, const std::string& what) { add_note(notes_, kind, text("{}: {}", who_, what)); }

 private:
  Record& record_;
  std::string who_;
  TextureSet& textures_;
  ImportNotes& notes_;
};

// "sheenColorFactor" -> "sheen_color".
std::string property_name(std::string name) {
  const std::string factor = "Factor";
  if (name.size() > factor.size() && name.ends_with(factor)) name.resize(name.size() - factor.size());
  std::string out;
  for (const char c : name) {
    if (std::isupper(static_cast<unsigned char>(c))) out += '_';
    out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

// Numbers of the KHR_materials_* extensions that are not read elsewhere, under their glTF names.
void put_extension_factors(const GltfExtensions& extensions, Record& record) {
  for (const auto& [name, extension] : extensions) {
    if (!name.starts_with("KHR_materials_") || name == "KHR_materials_emissive_strength" ||
        name == "KHR_materials_unlit" || name == "KHR_materials_pbrSpecularGlossiness")
      continue;
    for (const auto& [member, value] : extension.members) {
      if (value.kind == GltfValue::Kind::kNumber) put_numbers(record, property_name(member), {value.number});
      if (const auto numbers = value.numbers(size_t{0})) put_numbers(record, property_name(member), *numbers);
    }
  }
}

std::string alpha_word(const GltfMaterial& material, MaterialReader& reader) {
  if (material.alpha_mode == "MASK") return "mask";
  if (material.alpha_mode == "BLEND") return "blend";
  if (material.alpha_mode != "OPAQUE")
    reader.note(Kind::kWarning, text("alpha mode '{}' does not exist; taken as OPAQUE", material.alpha_mode));
  return "opaque";
}

// KHR_materials_pbrSpecularGlossiness seen as a dielectric: its specular colour is lost.
void read_specular_glossiness(const GltfValue& extension, GltfMaterial& material) {
  const auto diffuse = extension.numbers("diffuseFactor", 4);
  material.base_color = {1, 1, 1, 1};
  if (diffuse) std::copy_n(diffuse->begin(), 4, material.base_color.begin());
  material.metallic = 0;
  material.roughness = 1 - extension.number_or("glossinessFactor", 1);
  material.metallic_roughness_texture = {};
  material.base_color_texture = {};
  if (const GltfValue* texture = extension.find("diffuseTexture")) {
    material.base_color_texture.texture = texture->index("index");
    material.base_color_texture.uv_set = std::max(0, texture->index("texCoord"));
    if (const GltfValue* extensions = texture->find("extensions"))
      material.base_color_texture.extensions = extensions->members;
  }
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
    reader.texture("metallic_roughness_texture", material.metallic_roughness_texture, Role::kFactors, false);
}

void put_emission(const GltfMaterial& material, MaterialReader& reader, Record& record) {
  const GltfValue* extension = find_extension(material.extensions, "KHR_materials_emissive_strength");
  const double strength = extension ? extension->number_or("emissiveStrength", 1) : 1;
  std::vector<double> emission;
  for (const double f : material.emissive) {
    const double radiance = f * strength;
    if (!(radiance >= 0) || !std::isfinite(static_cast<float>(radiance)))
      reader.note(Kind::kWarning, text("its emission {} is no radiance; taken as 0", radiance));
    emission.push_back(radiance >= 0 && std::isfinite(static_cast<float>(radiance)) ? radiance : 0);
  }
  put_numbers(record, "emission", emission);
  if (emits(record)) reader.texture("emission_texture", material.emissive_texture, Role::kColor, false);
}

}  // namespace

Record read_material(const ImportContext& context, int index, TextureSet& textures, ImportNotes& notes) {
  GltfMaterial material;  // of no index: glTF's default, section 3.9.6
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
  record.type = unlit ? "unlit" : "metallic_roughness";
  put_base_color(material, reader, record);
  if (unlit) return record;
  put_surface(material, reader, record);
  put_emission(material, reader, record);
  put_extension_factors(material.extensions, record);
  return record;
}

void note_normal_maps(const ImportContext& context, const std::vector<int>& used, ImportNotes& notes) {
  Finding mapped;
  for (const int index : used) {
    if (index < 0) continue;
    const GltfMaterial& material = context.model.materials[static_cast<size_t>(index)];
    if (material.normal_texture.texture >= 0)
      mapped.add(element("material", static_cast<size_t>(index), material.name));
  }
  if (!mapped.empty())
    add_note(notes, Kind::kIgnored,
             text("normal maps are left out, light is baked for the surface itself, in {}",
                  mapped.list("material", "materials")));
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
