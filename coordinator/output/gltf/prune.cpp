// Removes data that the scene no longer references: replaced accessors and their bytes. Keeps data that an
// unknown extension may reference.
#include <algorithm>

#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

class Marks {
 public:
  explicit Marks(size_t size) : used(size, false) {}
  void add(const Json& index) {
    if (index.is_number_integer() && index.get<size_t>() < used.size()) used[index.get<size_t>()] = true;
  }
  void add_all(const Json& object) {
    for (const Json& index : object) add(index);
  }
  std::vector<bool> used;
};

const Json* at(const Json& object, const char* key) {
  return object.is_object() && object.contains(key) ? &object[key] : nullptr;
}
const Json& list(const Json& doc, const char* key) {
  static const Json kNone = Json::array();
  const Json* found = at(doc, key);
  return found && found->is_array() ? *found : kNone;
}

// Accessors named by meshes, instancing, animations and skins.
Marks named_accessors(const Json& doc) {
  Marks marks(list(doc, "accessors").size());
  for (const Json& mesh : list(doc, "meshes"))
    for (const Json& primitive : list(mesh, "primitives")) {
      if (const Json* attributes = at(primitive, "attributes")) marks.add_all(*attributes);
      if (const Json* indices = at(primitive, "indices")) marks.add(*indices);
      for (const Json& target : list(primitive, "targets")) marks.add_all(target);
    }
  for (const Json& node : list(doc, "nodes"))
    if (const Json* extensions = at(node, "extensions"))
      if (const Json* instancing = at(*extensions, kInstancing))
        if (const Json* attributes = at(*instancing, "attributes")) marks.add_all(*attributes);
  for (const Json& animation : list(doc, "animations"))
    for (const Json& sampler : list(animation, "samplers"))
      for (const char* key : {"input", "output"})
        if (const Json* index = at(sampler, key)) marks.add(*index);
  for (const Json& skin : list(doc, "skins"))
    if (const Json* index = at(skin, "inverseBindMatrices")) marks.add(*index);
  return marks;
}

Marks named_views(const Json& doc) {
  Marks marks(list(doc, "bufferViews").size());
  for (const Json& accessor : list(doc, "accessors")) {
    if (const Json* view = at(accessor, "bufferView")) marks.add(*view);
    if (const Json* sparse = at(accessor, "sparse"))
      for (const char* part : {"indices", "values"})
        if (const Json* p = at(*sparse, part))
          if (const Json* view = at(*p, "bufferView")) marks.add(*view);
  }
  for (const Json& image : list(doc, "images"))
    if (const Json* view = at(image, "bufferView")) marks.add(*view);
  return marks;
}

// Profiles of EXT_lights_ies; other root extensions may reference views in their own ways.
void mark_lights(const Json& doc, Marks& views) {
  if (const Json* extensions = at(doc, "extensions"))
    if (const Json* ies = at(*extensions, "EXT_lights_ies"))
      for (const Json& light : list(*ies, "lights"))
        if (const Json* view = at(light, "bufferView")) views.add(*view);
}

std::vector<size_t> new_numbers(const std::vector<bool>& used) {
  std::vector<size_t> number(used.size());
  size_t next = 0;
  for (size_t i = 0; i < used.size(); ++i) number[i] = used[i] ? next++ : SIZE_MAX;
  return number;
}

void renumber(Json& object, const char* key, const std::vector<size_t>& number) {
  if (object.is_object() && object.contains(key) && object[key].is_number_integer() &&
      object[key].get<size_t>() < number.size())
    object[key] = number[object[key].get<size_t>()];
}
void renumber_all(Json& object, const std::vector<size_t>& number) {
  for (auto it = object.begin(); it != object.end(); ++it)
    if (it->is_number_integer() && it->get<size_t>() < number.size()) *it = number[it->get<size_t>()];
}

void renumber_accessors(Json& doc, const std::vector<size_t>& number) {
  for (Json& mesh : doc["meshes"])
    for (Json& primitive : mesh["primitives"]) {
      renumber_all(primitive["attributes"], number);
      renumber(primitive, "indices", number);
      if (primitive.contains("targets"))
        for (Json& target : primitive["targets"]) renumber_all(target, number);
    }
  if (doc.contains("nodes"))
    for (Json& node : doc["nodes"])
      if (node.contains("extensions") && node["extensions"].contains(kInstancing))
        renumber_all(node["extensions"][kInstancing]["attributes"], number);
  if (doc.contains("animations"))
    for (Json& animation : doc["animations"])
      for (Json& sampler : animation["samplers"])
        for (const char* key : {"input", "output"}) renumber(sampler, key, number);
  if (doc.contains("skins"))
    for (Json& skin : doc["skins"]) renumber(skin, "inverseBindMatrices", number);
}

void renumber_views(Json& doc, const std::vector<size_t>& number) {
  if (doc.contains("accessors"))
    for (Json& accessor : doc["accessors"]) {
      renumber(accessor, "bufferView", number);
      if (accessor.contains("sparse"))
        for (const char* part : {"indices", "values"})
          renumber(accessor["sparse"][part], "bufferView", number);
    }
  if (doc.contains("images"))
    for (Json& image : doc["images"]) renumber(image, "bufferView", number);
  if (doc.contains("extensions") && doc["extensions"].contains("EXT_lights_ies"))
    for (Json& light : doc["extensions"]["EXT_lights_ies"]["lights"]) renumber(light, "bufferView", number);
}

// Extensions that reference no accessor or buffer view, or only where we look. If any other is in use,
// nothing is renumbered.
bool is_known(const std::string& extension) {
  static const char* const kKnown[] = {"EXT_mesh_gpu_instancing",
                                       "EXT_lights_ies",
                                       "EXT_lights_image_based",
                                       "EXT_texture_webp",
                                       "MSFT_lod",
                                       "MOZ_lightmap",
                                       "EPIC_lightmap_textures",
                                       "MX_lightmap",
                                       "KILN_lightmap",
                                       "KHR_mesh_quantization",
                                       "KHR_texture_transform",
                                       "KHR_texture_basisu",
                                       "KHR_lights_punctual",
                                       "KHR_animation_pointer",
                                       "KHR_xmp_json_ld",
                                       "MSFT_texture_dds",
                                       "EXT_texture_avif",
                                       "KHR_node_visibility",
                                       "KILN_probes"};
  for (const char* known : kKnown)
    if (extension == known) return true;
  return extension.rfind("KHR_materials_", 0) == 0;
}

// The entries of a list that `used` names, and by old number the new one.
std::vector<size_t> keep_used(Json& doc, const char* key, const std::vector<bool>& used) {
  Json kept = Json::array();
  for (size_t i = 0; i < used.size(); ++i)
    if (used[i]) kept.push_back(std::move(doc[key][i]));
  if (kept.empty())
    doc.erase(key);
  else
    doc[key] = std::move(kept);
  return new_numbers(used);
}

// Calls visit(object, key) for the number of every image that a texture names.
template <class Visit>
void for_each_source(Json& texture, const Visit& visit) {
  if (texture.contains("source")) visit(texture, "source");
  if (!texture.contains("extensions")) return;
  for (Json& extension : texture["extensions"])
    if (extension.is_object() && extension.contains("source")) visit(extension, "source");
}

// Extensions that only materials and textures have.
bool is_of_materials(const std::string& extension) {
  return extension.starts_with("KHR_materials_") || extension.starts_with("KHR_texture_") ||
         extension.starts_with("EXT_texture_") || extension.starts_with("MSFT_texture_");
}

bool is_in_use(const Json& value, const std::string& extension) {
  if (!value.is_structured()) return false;
  if (value.is_object() && value.contains("extensions") && value["extensions"].is_object() &&
      value["extensions"].contains(extension))
    return true;
  return std::any_of(value.begin(), value.end(),
                     [&](const Json& part) { return is_in_use(part, extension); });
}

}  // namespace

bool may_renumber(const Json& doc) {
  for (const Json& name : list(doc, "extensionsUsed"))
    if (!name.is_string() || name == "KHR_animation_pointer" || !is_known(name)) return false;
  return true;
}

void GltfOutput::drop_unused_materials() {
  if (!may_renumber(doc)) return;
  Marks materials(list(doc, "materials").size()), textures(list(doc, "textures").size()),
      images(list(doc, "images").size());
  for (const Json& mesh : list(doc, "meshes"))
    for (const Json& primitive : list(mesh, "primitives"))
      if (const Json* index = at(primitive, "material")) materials.add(*index);
  const std::vector<size_t> material = keep_used(doc, "materials", materials.used);
  const auto texture_of = [](Json& m) -> Json* {
    Json& pbr = m["pbrMetallicRoughness"];
    return pbr.contains("baseColorTexture") ? &pbr["baseColorTexture"] : nullptr;
  };
  for (Json& m : doc["materials"])
    if (const Json* use = texture_of(m)) textures.add((*use)["index"]);
  const std::vector<size_t> texture = keep_used(doc, "textures", textures.used);
  if (doc.contains("textures"))
    for (Json& t : doc["textures"])
      for_each_source(t, [&](Json& holder, const char* key) { images.add(holder[key]); });
  const std::vector<size_t> image = keep_used(doc, "images", images.used);
  for (Json& mesh : doc["meshes"])
    for (Json& primitive : mesh["primitives"]) renumber(primitive, "material", material);
  for (Json& m : doc["materials"])
    if (Json* use = texture_of(m)) renumber(*use, "index", texture);
  if (doc.contains("textures"))
    for (Json& t : doc["textures"])
      for_each_source(t, [&](Json& holder, const char* key) { renumber(holder, key, image); });
  for (const Json& name : Json(doc.value("extensionsUsed", Json::array())))
    if (name.is_string() && is_of_materials(name) && !is_in_use(doc, name))
      drop_extension(doc, name.get<std::string>().c_str());
}

void GltfOutput::drop_unused() {
  for (const Json& extension : list(doc, "extensionsUsed"))
    if (!extension.is_string() || !is_known(extension.get<std::string>())) return;
  const Marks accessors = named_accessors(doc);
  Json kept = Json::array();
  for (size_t i = 0; i < accessors.used.size(); ++i)
    if (accessors.used[i]) kept.push_back(std::move(doc["accessors"][i]));
  renumber_accessors(doc, new_numbers(accessors.used));
  if (kept.empty())
    doc.erase("accessors");
  else
    doc["accessors"] = std::move(kept);
  Marks views = named_views(doc);
  mark_lights(doc, views);
  buffer.keep_views(doc, views.used);
  renumber_views(doc, new_numbers(views.used));
}

}  // namespace kiln
