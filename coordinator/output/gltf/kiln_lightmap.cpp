// KILN_lightmap: describes the maps and the nodes that use them (docs/gltf.md, docs/schema).
#include "common/base/format.h"
#include "common/math/vec.h"
#include "common/responses/basis.h"
#include "coordinator/output/gltf/output_file.h"
#include "coordinator/output/look/tone.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

Json channel_json(const TextureChannel& c) {
  Json out = {{"plane", c.plane}};
  if (c.scale != 1) out["scale"] = c.scale;
  if (c.bias != 0) out["bias"] = c.bias;
  if (!c.times.empty()) out["times"] = c.times;
  if (!c.name.empty()) out["name"] = c.name;
  return out;
}

Json texture_json(const PublishedTexture& t) {
  Json out = {{"uri", t.uri},       {"container", t.container}, {"format", t.format}, {"width", t.width},
              {"height", t.height}, {"layers", t.layers},       {"levels", t.levels}, {"page", t.page}};
  if (!t.unpack.empty() && t.unpack != "none") {
    out["unpack"] = t.unpack;
    if (t.unpack != "rgbe") out["unpackRange"] = t.unpack_range;
  }
  out["channels"] = Json::array();
  for (const TextureChannel& c : t.channels) out["channels"].push_back(channel_json(c));
  return out;
}

// One master file of a page; readers find its channels by name.
Json master_json(const OutputContext& c, const std::string& stem, uint32_t page,
                 const std::vector<std::pair<std::string, std::string>>& channels) {
  Json out = {{"uri", page_name(stem, "exr", page, c.atlas.pages)},
              {"container", "exr"},
              {"format", "SFLOAT32"},
              {"width", c.atlas.width},
              {"height", c.atlas.height},
              {"layers", 1},
              {"levels", 1},
              {"page", page},
              {"channels", Json::array()}};
  for (const auto& [name, plane] : channels) out["channels"].push_back({{"plane", plane}, {"name", name}});
  return out;
}

Json masters_json(const OutputContext& c, const BasisInfo& basis) {
  Json textures = Json::array();
  std::vector<std::pair<std::string, std::string>> planes;
  const bool light = c.settings.quantities.light;
  if (light)
    for (const std::string_view function : basis.functions)
      for (const char* channel : {".R", ".G", ".B"}) {
        const std::string name = std::string(function) + channel;
        planes.emplace_back(name, name);
      }
  for (uint32_t page = 0; page < c.atlas.pages; ++page) {
    if (light)
      textures.push_back(
          master_json(c, "irradiance", page, {{"R", "E.R"}, {"G", "E.G"}, {"B", "E.B"}, {"A", "set"}}));
    if (!planes.empty()) textures.push_back(master_json(c, std::string(basis.name), page, planes));
    for (const uint32_t index : c.settings.quantities.responses) {
      const ResponseInfo& r = response_roster()[index];
      std::vector<std::pair<std::string, std::string>> stored;
      for (size_t s = 0; s < r.stored.size(); ++s) stored.emplace_back(r.stored[s], response_plane(r, s));
      textures.push_back(master_json(c, std::string(r.name), page, stored));
    }
  }
  return {{"name", "masters"}, {"container", "exr"}, {"textures", textures}};
}

Json diagnostics_json(const OutputContext& c) {
  Json textures = Json::array();
  std::vector<std::string> names{"samples", "validity"};
  if (c.settings.quantities.light) names.insert(names.begin(), "error");
  for (const uint32_t index : c.settings.quantities.responses)
    names.push_back(text("error_{}", response_roster()[index].name));
  for (const std::string& name : names)
    for (uint32_t page = 0; page < c.atlas.pages; ++page)
      textures.push_back(master_json(c, name, page, {{"Y", name}}));
  return textures;
}

Json basis_json(const BasisInfo& basis) {
  Json out = {{"name", basis.name}, {"functions", Json::array()}};
  for (const std::string_view function : basis.functions) out["functions"].push_back(function);
  if (!basis.convention.empty()) out["convention"] = basis.convention;
  if (!basis.fit.empty()) out["fit"] = basis.fit;
  if (!basis.evaluator.empty()) out["evaluator"] = basis.evaluator;
  out["axes"] = basis.is_local ? "surface" : "world";
  if (basis.is_local)
    out["frame"] =
        "z: shading normal n; with q = (2, 3, 6)/7 and t = (3, -6, 2)/7: x = t - (q + n) (t.n)/(1 + q.n), "
        "y = n cross x";
  if (!basis.axes.empty()) {
    out["lobes"] = Json::array();
    for (const Vec3& axis : basis.axes) out["lobes"].push_back({axis.x, axis.y, axis.z});
  }
  return out;
}

// Describes every response, for readers that look up planes by name.
Json responses_json(const BakeSettings& settings) {
  Json out = Json::array();
  for (const uint32_t index : settings.quantities.responses) {
    const ResponseInfo& r = response_roster()[index];
    Json planes = Json::array();
    for (size_t s = 0; s < r.stored.size(); ++s) planes.push_back(response_plane(r, s));
    out.push_back({{"name", r.name}, {"about", r.about}, {"planes", planes}});
  }
  return out;
}

bool has_mark(const Json& primitive) {
  return primitive.contains("extensions") && primitive["extensions"].contains(kKilnLightmap);
}

}  // namespace

float viewing_exposure(const OutputContext& c) {
  if (!c.lightmap.has_light) return 1.0f;
  constexpr float kMiddleAlbedo = 0.5f;
  std::vector<float> radiance;
  for (size_t t = 0; t < c.lightmap.validity.size(); ++t)
    if (c.lightmap.validity[t] == Validity::kMeasured) {
      const Vec3 e(c.lightmap.planes.data[0][t], c.lightmap.planes.data[1][t], c.lightmap.planes.data[2][t]);
      radiance.push_back(luminance(e) * kInvPi * kMiddleAlbedo);
    }
  return exposure_of(std::move(radiance));
}

void use_extension(Json& doc, const char* name) {
  Json& used = doc["extensionsUsed"];
  if (!used.is_array()) used = Json::array();
  for (const Json& other : used)
    if (other == name) return;
  used.push_back(name);
}

void GltfOutput::attach_kiln_lightmap(bool by_table) {
  const BasisInfo& basis = basis_of(c_->settings);
  Json map = {{"width", c_->atlas.width},   {"height", c_->atlas.height},
              {"pages", c_->atlas.pages},   {"texCoord", 1},
              {"encodings", Json::array()}, {"diagnostics", diagnostics_json(*c_)}};
  if (c_->settings.quantities.light) {
    map["quantity"] = "irradiance";
    map["unit"] = "that of the scene's radiance, times steradian";
    map["basis"] = basis_json(basis);
    map["exposure"] = viewing_exposure(*c_);
  }
  if (!lamps_.is_null()) map["lamps"] = lamps_;
  if (!c_->settings.quantities.responses.empty()) map["responses"] = responses_json(c_->settings);
  if (by_table) map["chartTable"] = {{"uri", "charts.bin"}, {"attribute", "_CHART"}};
  if (c_->textures)
    for (const PublishedEncoding& e : *c_->textures) {
      Json encoding = {{"name", e.name}, {"container", e.container}, {"textures", Json::array()}};
      for (const PublishedTexture& t : e.textures) encoding["textures"].push_back(texture_json(t));
      map["encodings"].push_back(std::move(encoding));
    }
  map["encodings"].push_back(masters_json(*c_, basis));
  doc["extensions"][kKilnLightmap] = {{"version", 1}, {"lightmaps", Json::array({map})}};
  use_extension(doc, kKilnLightmap);
  if (!doc.contains("nodes")) return;
  for (Json& node : doc["nodes"]) {
    if (!node.contains("mesh")) continue;
    std::set<uint32_t> pages;
    bool marked = false;
    for (const Json& primitive : doc["meshes"][node["mesh"].get<size_t>()]["primitives"]) {
      if (!has_mark(primitive)) continue;
      marked = true;
      const Json& mark = primitive["extensions"][kKilnLightmap];
      if (mark.contains("page")) pages.insert(mark["page"].get<uint32_t>());
    }
    if (!marked) continue;
    Json& on_node = node["extensions"][kKilnLightmap] = {{"lightmap", 0}};
    if (!pages.empty()) on_node["pages"] = pages;
    if (node.contains("extras") && node["extras"].is_object() && node["extras"].contains("kiln") &&
        node["extras"]["kiln"].contains("first_chart"))
      on_node["firstChart"] = node["extras"]["kiln"]["first_chart"];
  }
}

void drop_extension(Json& doc, const char* name) {
  const auto drop = [&](Json& object) {
    if (!object.is_object() || !object.contains("extensions") || !object["extensions"].is_object()) return;
    object["extensions"].erase(name);
    if (object["extensions"].empty()) object.erase("extensions");
  };
  drop(doc);
  for (const char* list : {"nodes", "meshes", "materials"})
    if (doc.contains(list))
      for (Json& object : doc[list]) {
        drop(object);
        if (object.is_object() && object.contains("primitives"))
          for (Json& primitive : object["primitives"]) drop(primitive);
      }
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    if (!doc.contains(key)) continue;
    Json kept = Json::array();
    for (const Json& other : doc[key])
      if (other != name) kept.push_back(other);
    if (kept.empty())
      doc.erase(key);
    else
      doc[key] = std::move(kept);
  }
}

}  // namespace kiln
