// Lamps and image-based light whose light is in the map: a viewer that also lights the scene by them shows
// their light twice. --lamps says whether they are left out, marked or kept (docs/gltf.md).
#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr const char* kPunctual = "KHR_lights_punctual";
constexpr const char* kIes = "EXT_lights_ies";
constexpr const char* kImageBased = "EXT_lights_image_based";

bool has_extension(const Json& object, const char* name) {
  return object.contains("extensions") && object["extensions"].is_object() &&
         object["extensions"].contains(name);
}

void erase_extension(Json& object, const char* name) {
  if (!has_extension(object, name)) return;
  object["extensions"].erase(name);
  if (object["extensions"].empty()) object.erase("extensions");
}

// Erases a key of extras.kiln, and what is then empty.
void erase_note(Json& object, const char* key) {
  if (!object.contains("extras") || !object["extras"].is_object() || !object["extras"].contains("kiln"))
    return;
  Json& kiln = object["extras"]["kiln"];
  if (!kiln.is_object()) return;
  kiln.erase(key);
  if (kiln.empty()) object["extras"].erase("kiln");
  if (object["extras"].empty()) object.erase("extras");
}

// Removes from a node what makes it a lamp: the reference to its light, or extras.kiln.light.
void erase_lamp(Json& node, const std::string& type) {
  if (type == "rectangle" || type == "disc")
    erase_note(node, "light");
  else
    erase_extension(node, type == "ies" ? kIes : kPunctual);
}

// Entries of the root's list that no object names any more; the extension where none is left.
void drop_unnamed_lights(Json& doc, const char* extension, const char* users) {
  if (!has_extension(doc, extension)) return;
  Json& root = doc["extensions"][extension];
  if (!root.is_object() || !root.contains("lights") || !root["lights"].is_array()) return;
  std::vector<bool> named(root["lights"].size(), false);
  std::vector<Json*> indices;
  for (Json& object : doc[users])
    if (has_extension(object, extension) && object["extensions"][extension].contains("light")) {
      Json& index = object["extensions"][extension]["light"];
      if (!index.is_number_unsigned() || index.get<size_t>() >= named.size()) return;
      named[index.get<size_t>()] = true;
      indices.push_back(&index);
    }
  if (indices.empty()) {
    drop_extension(doc, extension);
    return;
  }
  std::vector<size_t> number(named.size(), 0);
  Json kept = Json::array();
  for (size_t i = 0; i < named.size(); ++i) {
    if (!named[i]) continue;
    number[i] = kept.size();
    kept.push_back(std::move(root["lights"][i]));
  }
  for (Json* index : indices) *index = number[index->get<size_t>()];
  root["lights"] = std::move(kept);
}

}  // namespace

void GltfOutput::treat_lamps() {
  const LampChoice lamps = choose_lamps(*c_);
  lamps_ = {{"mode", lamps.mode}};
  const size_t baked_scene = doc.value("scene", size_t{0});
  Json* sky = nullptr;
  if (lamps.sky && doc.contains("scenes") && baked_scene < doc["scenes"].size() &&
      has_extension(doc["scenes"][baked_scene], kImageBased))
    sky = &doc["scenes"][baked_scene];
  if (doc.contains("nodes"))
    for (Json& node : doc["nodes"]) erase_note(node, "baked");  // of an earlier bake
  if (lamps.mode == "drop") {
    for (const DisplayLamp* lamp : lamps.in_map) erase_lamp(doc["nodes"][lamp->node], lamp->type);
    if (sky) erase_extension(*sky, kImageBased);
    if (may_renumber(doc)) {
      drop_unnamed_lights(doc, kPunctual, "nodes");
      drop_unnamed_lights(doc, kIes, "nodes");
      if (sky) drop_unnamed_lights(doc, kImageBased, "scenes");
    }
    return;
  }
  std::set<uint32_t> nodes;
  for (const DisplayLamp* lamp : lamps.in_map) nodes.insert(lamp->node);
  if (!nodes.empty()) lamps_["nodes"] = nodes;
  if (lamps.mode != "mark") return;
  for (const uint32_t node : nodes) note(doc["nodes"][node])["baked"] = true;
  if (sky) note(*sky)["baked"] = true;
}

void GltfOutput::drop_lamps() {
  if (doc.contains("nodes"))
    for (Json& node : doc["nodes"]) erase_note(node, "light");
  for (const char* list : {"nodes", "scenes"})
    if (doc.contains(list))
      for (Json& object : doc[list])
        for (const char* extension : {kPunctual, kIes, kImageBased}) erase_extension(object, extension);
  for (const char* extension : {kPunctual, kIes, kImageBased}) drop_extension(doc, extension);
}

}  // namespace kiln
