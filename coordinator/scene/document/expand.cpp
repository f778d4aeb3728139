#include "coordinator/scene/document/expand.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/format.h"
#include "coordinator/scene/document/draco.h"
#include "coordinator/scene/document/gltf_component.h"
#include "coordinator/scene/document/meshopt.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr const char* kMeshopt[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

// The member of "extensions", or null.
json* extension_of(json& element, const char* name) {
  const auto extensions = element.is_object() ? element.find("extensions") : element.end();
  if (!element.is_object() || extensions == element.end() || !extensions->is_object()) return nullptr;
  const auto found = extensions->find(name);
  return found != extensions->end() && found->is_object() ? &*found : nullptr;
}

void drop_extension(json& element, const char* name) {
  json& extensions = element["extensions"];
  extensions.erase(name);
  if (extensions.empty()) element.erase("extensions");
}

// A whole number; absent: `otherwise`; anything else: nullopt.
std::optional<uint64_t> whole(const json& object, const char* name, std::optional<uint64_t> otherwise = {}) {
  const auto it = object.find(name);
  if (it == object.end()) return otherwise;
  if (it->is_number_unsigned()) return it->get<uint64_t>();
  if (!it->is_number_float()) return std::nullopt;
  const double value = it->get<double>();
  if (!(value >= 0 && value < 0x1p53) || value != static_cast<double>(static_cast<uint64_t>(value)))
    return std::nullopt;
  return static_cast<uint64_t>(value);
}

template <class Value, size_t count>
std::optional<Value> word(const json& object, const char* name,
                          const std::pair<const char*, Value> (&words)[count]) {
  const auto it = object.find(name);
  if (it == object.end() || !it->is_string()) return std::nullopt;
  for (const auto& [spelling, value] : words)
    if (*it == spelling) return value;
  return std::nullopt;
}

class Expander {
 public:
  Expander(json& root, GltfBuffers& buffers, ImportBudget& budget, const std::filesystem::path& path)
      : root_(root), buffers_(buffers), budget_(budget), path_(path) {}

  Status views();
  Status primitives();
  std::vector<std::string> used() const;
  void forget(const std::vector<std::string>& names);

 private:
  tl::unexpected<Error> bad(const std::string& who, const std::string& what) const {
    return fail(ErrorKind::kInvalidInput, text("{}: {}: {}", path_.string(), who, what));
  }
  // An error of a decoder, which knows neither file nor element.
  tl::unexpected<Error> blame(const std::string& who, const Error& error) const {
    if (budget_.is_spent()) return fail(error.kind, error.message);  // it names both
    return bad(who, error.message);
  }
  Expected<std::span<const std::byte>> bytes_of_range(const std::string& who, const json& range) const;
  Status expand_view(json& view, size_t index, const char* name);
  Status expand_primitive(json& primitive, const std::string& who);
  // Whether the positions are there uncompressed too, as the original that Draco's are rounded from.
  bool has_fallback(const json& primitive) const;
  Expected<DracoRequest> request(const json& accessors, const json& index, const json& id,
                                 const std::string& who) const;
  // A new buffer of one view; the view's number.
  size_t add(Bytes bytes);
  // A copy of an accessor that reads a new view; its number.
  size_t add_accessor(json accessor, Bytes bytes, size_t count);
  json* list(json& object, const char* name) const {
    const auto it = object.find(name);
    return it != object.end() && it->is_array() ? &*it : nullptr;
  }

  json& root_;
  GltfBuffers& buffers_;
  ImportBudget& budget_;
  const std::filesystem::path& path_;
};

Expected<std::span<const std::byte>> Expander::bytes_of_range(const std::string& who,
                                                              const json& range) const {
  const auto buffer = whole(range, "buffer"), offset = whole(range, "byteOffset", 0),
             length = whole(range, "byteLength");
  if (!buffer || !offset || !length)
    return bad(who, "its buffer, byteOffset or byteLength is no whole number");
  if (*buffer >= buffers_.size())
    return bad(who, text("buffer {} does not exist, there are {}", *buffer, buffers_.size()));
  const Bytes& bytes = *buffers_[*buffer];
  if (*offset > bytes.size() || *length > bytes.size() - *offset)
    return bad(who, text("bytes {} + {} do not fit in buffer {} of {} bytes", *offset, *length, *buffer,
                         bytes.size()));
  return std::span<const std::byte>(bytes).subspan(*offset, *length);
}

Status Expander::expand_view(json& view, size_t index, const char* name) {
  static constexpr std::pair<const char*, MeshoptMode> kModes[] = {{"ATTRIBUTES", MeshoptMode::kAttributes},
                                                                   {"TRIANGLES", MeshoptMode::kTriangles},
                                                                   {"INDICES", MeshoptMode::kIndices}};
  static constexpr std::pair<const char*, MeshoptFilter> kFilters[] = {
      {"NONE", MeshoptFilter::kNone},
      {"OCTAHEDRAL", MeshoptFilter::kOctahedral},
      {"QUATERNION", MeshoptFilter::kQuaternion},
      {"EXPONENTIAL", MeshoptFilter::kExponential}};
  const std::string who = text("buffer view {}: {}", index, name);
  const json& range = *extension_of(view, name);
  KILN_TRY(const std::span<const std::byte> packed, bytes_of_range(who, range));
  const auto count = whole(range, "count"), stride = whole(range, "byteStride");
  const auto mode = word(range, "mode", kModes);
  const auto filter = range.contains("filter") ? word(range, "filter", kFilters) : MeshoptFilter::kNone;
  if (!count || !stride) return bad(who, "its count or byteStride is no whole number");
  if (!mode) return bad(who, "its mode is none of ATTRIBUTES, TRIANGLES and INDICES");
  if (!filter) return bad(who, "its filter is none of NONE, OCTAHEDRAL, QUATERNION and EXPONENTIAL");
  const MeshoptLayout layout{*mode, *filter, *count, *stride};
  if (const Status s = check_meshopt(layout); !s) return bad(who, s.error().message);
  if (*count > most_meshopt_elements(layout, packed.size()))
    return bad(who,
               text("{} packed bytes cannot hold {} elements of {} bytes", packed.size(), *count, *stride));
  if (whole(view, "byteLength") != *count * *stride)  // bounded by the file, so no overflow
    return bad(who, text("{} elements of {} bytes are not the view's byteLength", *count, *stride));
  KILN_TRY_STATUS(budget_.take(*count * *stride, text("data of {}", name)));
  Bytes bytes(*count * *stride);
  if (const Status s = unpack_meshopt(layout, packed, bytes); !s) return bad(who, s.error().message);
  drop_extension(view, name);
  view["buffer"] = buffers_.size();
  view["byteOffset"] = 0;
  buffers_.push_back(std::make_shared<const Bytes>(std::move(bytes)));
  return {};
}

Status Expander::views() {
  json* views = list(root_, "bufferViews");
  for (size_t i = 0; views && i < views->size(); ++i)
    for (const char* name : kMeshopt)
      if (extension_of((*views)[i], name)) KILN_TRY_STATUS(expand_view((*views)[i], i, name));
  return {};
}

size_t Expander::add(Bytes bytes) {
  json& views = root_["bufferViews"];
  views.push_back({{"buffer", buffers_.size()}, {"byteOffset", 0}, {"byteLength", bytes.size()}});
  buffers_.push_back(std::make_shared<const Bytes>(std::move(bytes)));
  return views.size() - 1;
}

size_t Expander::add_accessor(json accessor, Bytes bytes, size_t count) {
  for (const char* name : {"sparse", "byteOffset"}) accessor.erase(name);
  accessor["bufferView"] = add(std::move(bytes));
  accessor["count"] = count;
  root_["accessors"].push_back(std::move(accessor));
  return root_["accessors"].size() - 1;
}

Expected<DracoRequest> Expander::request(const json& accessors, const json& index, const json& id,
                                         const std::string& who) const {
  static constexpr std::pair<const char*, uint32_t> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  if (!index.is_number_unsigned() || index.get<uint64_t>() >= accessors.size())
    return bad(
        who, text("accessor {} does not exist, there are {}", index.dump().substr(0, 40), accessors.size()));
  if (!id.is_number_unsigned() || id.get<uint64_t>() > UINT32_MAX)
    return bad(who, text("{} is no attribute of Draco data", id.dump().substr(0, 40)));
  const json& accessor = accessors[index.get<size_t>()];
  if (!accessor.is_object()) return bad(who, "its accessor is no object");
  const auto components = word(accessor, "type", kTypes);
  const auto type = whole(accessor, "componentType");
  if (!components || !type || *type > 5126 || component_bytes(static_cast<int>(*type)) == 0)
    return bad(who, "its accessor's type is none that vertices have");
  return DracoRequest{static_cast<uint32_t>(id.get<uint64_t>()), static_cast<int>(*type), *components};
}

bool Expander::has_fallback(const json& primitive) const {
  const json* accessors = list(root_, "accessors");
  const auto attributes = primitive.find("attributes");
  if (!accessors || attributes == primitive.end() || !attributes->is_object()) return false;
  const auto position = whole(*attributes, "POSITION");
  return position && *position < accessors->size() && (*accessors)[*position].contains("bufferView");
}

Status Expander::expand_primitive(json& primitive, const std::string& who) {
  if (has_fallback(primitive)) {
    drop_extension(primitive, kDraco);
    return {};
  }
  const json extension = *extension_of(primitive, kDraco);
  const json* views = list(root_, "bufferViews");
  const json* accessors = list(root_, "accessors");
  const auto view = whole(extension, "bufferView");
  const auto mode = whole(primitive, "mode", 4);
  const auto ids = extension.find("attributes");
  const auto attributes = primitive.find("attributes");
  if (!views || !view || *view >= views->size() || !(*views)[*view].is_object())
    return bad(who, "the buffer view of its Draco data does not exist");
  if (!mode || (*mode != 4 && *mode != 5))
    return bad(who, "Draco data is of triangles or strips, its mode is neither");
  if (!accessors || ids == extension.end() || !ids->is_object() || attributes == primitive.end() ||
      !attributes->is_object())
    return bad(who, "its attributes, or those of its Draco data, are missing");
  KILN_TRY(const std::span<const std::byte> packed, bytes_of_range(who, (*views)[*view]));
  std::vector<DracoRequest> requests;
  for (const auto& [name, id] : ids->items()) {
    const auto accessor = attributes->find(name);
    if (accessor == attributes->end())
      return bad(who, text("its Draco data has {}, the primitive has not", name));
    KILN_TRY(const DracoRequest one, request(*accessors, *accessor, id, text("{} attribute {}", who, name)));
    requests.push_back(one);
  }
  const auto take = [&](uint64_t bytes) { return budget_.take(bytes, text("data of {}", kDraco)); };
  auto mesh = unpack_draco(packed, requests, take);
  if (!mesh) return blame(who, mesh.error());
  size_t next = 0;
  for (const auto& [name, id] : ids->items()) {
    json& accessor = (*attributes)[name];
    accessor = add_accessor(root_["accessors"][accessor.get<size_t>()], std::move(mesh->attributes[next++]),
                            mesh->vertices);
  }
  const size_t corners = mesh->indices.size();
  const auto bytes = bytes_of(mesh->indices);
  primitive["indices"] =
      add_accessor({{"componentType", 5125}, {"type", "SCALAR"}}, Bytes(bytes.begin(), bytes.end()), corners);
  primitive["mode"] = 4;
  drop_extension(primitive, kDraco);
  return {};
}

Status Expander::primitives() {
  json* meshes = list(root_, "meshes");
  for (size_t m = 0; meshes && m < meshes->size(); ++m) {
    if (!(*meshes)[m].is_object()) continue;
    json* primitives = list((*meshes)[m], "primitives");
    for (size_t p = 0; primitives && p < primitives->size(); ++p)
      if (extension_of((*primitives)[p], kDraco))
        KILN_TRY_STATUS(expand_primitive((*primitives)[p], text("mesh {} primitive {}: {}", m, p, kDraco)));
  }
  return {};
}

std::vector<std::string> Expander::used() const {
  std::vector<std::string> names;
  for (const char* lists : {"extensionsUsed", "extensionsRequired"})
    if (const json* words = list(root_, lists))
      for (const json& name : *words)
        for (const char* known : {kDraco, kMeshopt[0], kMeshopt[1]})
          if (name == known && std::find(names.begin(), names.end(), known) == names.end())
            names.push_back(known);
  return names;
}

void Expander::forget(const std::vector<std::string>& names) {
  for (const char* lists : {"extensionsUsed", "extensionsRequired"}) {
    json* words = list(root_, lists);
    if (!words) continue;
    json kept = json::array();
    for (const json& name : *words)
      if (!name.is_string() || std::find(names.begin(), names.end(), name.get<std::string>()) == names.end())
        kept.push_back(name);
    if (kept.empty())
      root_.erase(lists);
    else
      *words = std::move(kept);
  }
  json* listed = list(root_, "buffers");
  for (size_t i = 0; listed && i < listed->size(); ++i)
    for (const char* name : kMeshopt)  // fallback buffers: nothing reads them any more
      if (extension_of((*listed)[i], name)) drop_extension((*listed)[i], name);
  for (size_t i = listed ? listed->size() : 0; i < buffers_.size(); ++i)
    root_["buffers"].push_back({{"byteLength", buffers_[i]->size()}});
}

}  // namespace

Expected<std::vector<std::string>> expand_compressed(json& root, GltfBuffers& buffers, ImportBudget& budget,
                                                     const std::filesystem::path& path) {
  Expander expander(root, buffers, budget, path);
  std::vector<std::string> names = expander.used();
  KILN_TRY_STATUS(expander.views());
  KILN_TRY_STATUS(expander.primitives());
  expander.forget(names);
  return names;
}

}  // namespace kiln
