// TEXCOORD_1 is reserved for the lightmap. glTF 2.0, 3.7.2.1: sets of one primitive are numbered without
// gaps.
#include <algorithm>
#include <functional>

#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kSet = "TEXCOORD_";

std::string set_name(size_t set) {
  return std::string(kSet) + std::to_string(set);
}

// 0: it has none; else one more than the highest set.
size_t sets_of(const Json& primitive) {
  size_t sets = 0;
  for (const auto& [name, accessor] : primitive["attributes"].items())
    if (name.rfind(kSet, 0) == 0 && name.size() == kSet.size() + 1 && name.back() >= '0' &&
        name.back() <= '9')
      sets = std::max(sets, static_cast<size_t>(name.back() - '0') + 1);
  return sets;
}

// Visits every texCoord of materials' textures, including those in extensions.
void for_each_texcoord(Json& value, const std::function<void(Json&)>& visit) {
  if (value.is_object() && value.contains("texCoord") && value["texCoord"].is_number_integer())
    visit(value["texCoord"]);
  if (value.is_structured())
    for (Json& child : value) for_each_texcoord(child, visit);
}

}  // namespace

void GltfOutput::free_texcoord_1() {
  if (!doc.contains("materials")) return;
  bool taken = false;
  for_each_texcoord(doc["materials"], [&](Json& set) { taken |= set == 1; });
  if (!taken) return;
  size_t free_set = 2;
  for (const Json& mesh : doc["meshes"])
    for (const Json& primitive : mesh["primitives"]) free_set = std::max(free_set, sets_of(primitive));
  for (Json& mesh : doc["meshes"])
    for (Json& primitive : mesh["primitives"]) {
      Json& attributes = primitive["attributes"];
      if (!attributes.contains("TEXCOORD_1")) continue;
      attributes[set_name(free_set)] = attributes["TEXCOORD_1"];
      attributes.erase("TEXCOORD_1");
    }
  for_each_texcoord(doc["materials"], [&](Json& set) {
    if (set == 1) set = free_set;
  });
}

void GltfOutput::fill_texcoord_gaps() {
  for (Json& mesh : doc["meshes"])
    for (Json& primitive : mesh["primitives"]) {
      Json& attributes = primitive["attributes"];
      const size_t sets = sets_of(primitive);
      for (size_t set = 0; set + 1 < sets; ++set)
        if (!attributes.contains(set_name(set))) attributes[set_name(set)] = attributes[set_name(sets - 1)];
    }
}

}  // namespace kiln
