#include "coordinator/scene/document/variants.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/format.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "KHR_materials_variants";
constexpr size_t kMostNamed = 20, kLongestName = 120;  // in a message

const json* member(const json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

const json* of_extension(const json& object, const char* name) {
  const json* extensions = member(object, "extensions");
  const json* extension = extensions ? member(*extensions, kExtension) : nullptr;
  return extension ? member(*extension, name) : nullptr;
}

// The material that a mapping gives for the variant, or -1.
Expected<int64_t> material_for(const json& mapping, uint64_t variant, const std::string& where) {
  const json* variants = member(mapping, "variants");
  const json* material = member(mapping, "material");
  if (!variants || !variants->is_array() || !material || !material->is_number_unsigned())
    return fail(ErrorKind::kInvalidInput,
                text("{}: a mapping of {} has not a list of variants and a material", where, kExtension));
  const bool covers = std::any_of(variants->begin(), variants->end(), [&](const json& index) {
    return index.is_number_unsigned() && index.get<uint64_t>() == variant;
  });
  if (!covers) return int64_t{-1};
  const uint64_t index = material->get<uint64_t>();
  if (index > INT32_MAX)
    return fail(ErrorKind::kInvalidInput, text("{}: there is no material {}", where, index));
  return static_cast<int64_t>(index);
}

}  // namespace

std::vector<std::string> variant_names(const json& root) {
  std::vector<std::string> names;
  const json* variants = of_extension(root, "variants");
  if (!variants || !variants->is_array()) return names;
  for (const json& variant : *variants) {
    const json* name = member(variant, "name");
    names.push_back(name && name->is_string() ? name->get<std::string>() : "");
  }
  return names;
}

std::string listed_variants(const std::vector<std::string>& names) {
  std::string out;
  size_t shown = 0;
  for (const std::string& name : names) {
    if (shown == kMostNamed) break;
    if (name.empty() || name.size() > kLongestName) continue;
    out += text("{}'{}'", shown++ ? ", " : "", name);
  }
  if (!shown) return text("{} without a name to show", names.size());
  return out + (names.size() > shown ? text(" and {} more", names.size() - shown) : "");
}

Status choose_variant(json& root, const std::vector<std::string>& names, const std::string& variant,
                      const std::string& file) {
  const auto chosen = std::find(names.begin(), names.end(), variant);
  if (chosen == names.end())
    return fail(ErrorKind::kInvalidInput,
                names.empty() ? text("{}: --variant {}: the file has no material variants", file, variant)
                              : text("{}: --variant {}: there is no such variant, there are {}", file,
                                     variant, listed_variants(names)));
  const auto index = static_cast<uint64_t>(chosen - names.begin());
  const auto meshes = root.find("meshes");
  if (meshes == root.end() || !meshes->is_array()) return {};
  for (size_t m = 0; m < meshes->size(); ++m) {
    json& mesh = (*meshes)[m];
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
    for (size_t p = 0; p < mesh["primitives"].size(); ++p) {
      json& primitive = mesh["primitives"][p];
      const json* mappings = of_extension(primitive, "mappings");
      if (!mappings || !mappings->is_array()) continue;
      int64_t material = -1;
      for (const json& mapping : *mappings) {
        KILN_TRY(material, material_for(mapping, index, text("{}: mesh {} primitive {}", file, m, p)));
        if (material >= 0) break;
      }
      if (material >= 0) primitive["material"] = material;
    }
  }
  return {};
}

}  // namespace kiln
