// Lightmaps for viewers without KILN_lightmap: pages as embedded 8-bit images, in three vendor extensions.
//
// MOZ_lightmap (Hubs; https://github.com/takahirox/MOZ_lightmap): {index, texCoord, intensity} on a material.
// Renderers add texel x intensity to the irradiance, texels linear: E = texel x intensity.
//
// EPIC_lightmap_textures (glTF exporter of Unreal Engine): a list of lightmaps at the root, the number of one
// on each node. A texture is two images on top of each other:
//   upper  RGB: root of the colour; A: high byte of the logarithm of L
//   lower  RGB: direction, which readers replace by the constant 0.6; A: low byte
// E/pi = 0.6 L max(0, rgb^2 scale + add), L = 2^(log scale.w + add.w) - 0.01858136.
//
// MX_lightmap (Third Room; https://github.com/matrix-org/thirdroom, docs/gltf/MX_lightmap): {lightMapTexture,
// scale, offset, intensity} on a node. The texture is RGBM as Unity stores it; its reader draws with
// three.js's physically correct lights: E = 34.49 a^2.2 rgb x intensity.
#include <array>
#include <cmath>

#include "common/math/trig.h"
#include "coordinator/output/gltf/output_file.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr const char* kMoz = "MOZ_lightmap";
constexpr const char* kEpic = "EPIC_lightmap_textures";
constexpr const char* kMx = "MX_lightmap";
constexpr double kMxRange = 34.49;
constexpr float kMxPower = 2.2f;
constexpr double kEpicBlack = 0.01858136, kEpicDirectionality = 0.6;

Vec3 irradiance_of(const Lightmap& map, size_t texel) {
  if (!is_set(map.validity[texel])) return Vec3(0.0f);
  Vec3 e(map.planes.data[0][texel], map.planes.data[1][texel], map.planes.data[2][texel]);
  for (int c = 0; c < 3; ++c) e[c] = std::isfinite(e[c]) ? std::max(0.0f, e[c]) : 0.0f;
  return e;
}

// The E of code 255. Not the maximum, which would waste eight bits on a few texels beside a lamp: one texel
// in a thousand is clipped.
float brightest(const OutputContext& c) {
  std::vector<float> largest;
  for (size_t t = 0; t < c.lightmap.validity.size(); ++t)
    if (const float e = max_component(irradiance_of(c.lightmap, t)); e > 0) largest.push_back(e);
  if (largest.empty()) return 1.0f;
  const auto at = largest.begin() + static_cast<ptrdiff_t>((largest.size() - 1) * 999 / 1000);
  std::nth_element(largest.begin(), at, largest.end());
  return *at;
}

uint8_t byte_of(double unit) {
  return static_cast<uint8_t>(std::clamp(unit, 0.0, 1.0) * 255 + 0.5);
}

// Material of a primitive, and those of its variants (KHR_materials_variants).
template <class Visit>
void for_each_material(Json& primitive, const Visit& visit) {
  visit(primitive);
  if (primitive.contains("extensions") && primitive["extensions"].contains("KHR_materials_variants"))
    for (Json& mapping : primitive["extensions"]["KHR_materials_variants"]["mappings"]) visit(mapping);
}

constexpr int kNoPage = -1;
int page_of(const Json& primitive) {
  if (!primitive.contains("extensions") || !primitive["extensions"].contains(kKilnLightmap)) return kNoPage;
  return primitive["extensions"][kKilnLightmap].value("page", kNoPage);
}

bool is_unlit(const Json& material) {
  return material.contains("extensions") && material["extensions"].contains("KHR_materials_unlit");
}

// Materials by page: the first user keeps the material, others get copies.
class PageMaterials {
 public:
  explicit PageMaterials(Json& doc) : doc_(doc) {}

  size_t of(const Json& holder, int page) {
    if (!doc_.contains("materials")) doc_["materials"] = Json::array();
    size_t material = kDefault;
    if (holder.contains("material")) material = holder["material"].get<size_t>();
    if (const auto it = made_.find({material, page}); it != made_.end()) return it->second;
    size_t place = material;
    if (material == kDefault || !taken_.insert(material).second) {
      place = doc_["materials"].size();
      doc_["materials"].push_back(material == kDefault ? Json{{"name", "default"}} : original(material));
    } else {
      originals_[material] = doc_["materials"][material];
    }
    made_[{material, page}] = place;
    return place;
  }
  const std::map<std::pair<size_t, int>, size_t>& made() const { return made_; }

 private:
  static constexpr size_t kDefault = SIZE_MAX;
  Json original(size_t material) const { return originals_.at(material); }

  Json& doc_;
  std::set<size_t> taken_;
  std::map<size_t, Json> originals_;
  std::map<std::pair<size_t, int>, size_t> made_;  // by material of the file and page
};

bool has_planes(const OutputContext& c) {
  return c.lightmap.has_light && c.lightmap.planes.data.size() >= 3 &&
         c.lightmap.validity.size() == c.atlas.texel_count();
}

// One page: its texels as bytes.
Expected<Bytes> moz_page(const OutputContext& c, uint32_t page, float intensity) {
  const size_t count = size_t{c.atlas.width} * c.atlas.height;
  std::vector<uint8_t> rgb(3 * count);
  for (size_t t = 0; t < count; ++t) {
    const Vec3 e = irradiance_of(c.lightmap, page * count + t);
    for (size_t k = 0; k < 3; ++k) rgb[3 * t + k] = byte_of(double{e[static_cast<int>(k)]} / intensity);
  }
  return encode_png(c.atlas.width, c.atlas.height, rgb);
}

// Ambient occlusion, if baked.
const std::vector<float>* occlusion_plane(const OutputContext& c) {
  const std::vector<uint32_t>& responses = c.settings.quantities.responses;
  if (std::find(responses.begin(), responses.end(), Responses::index_of<AmbientOcclusion>()) ==
          responses.end() ||
      c.lightmap.validity.size() != c.atlas.texel_count())
    return nullptr;
  return &c.lightmap.responses.plane(std::string(AmbientOcclusion::name));
}

// glTF reads the red channel; stored as grey so that the image is viewable.
Expected<Bytes> occlusion_page(const OutputContext& c, uint32_t page, const std::vector<float>& plane) {
  const size_t count = size_t{c.atlas.width} * c.atlas.height;
  std::vector<uint8_t> rgb(3 * count, 255);
  for (size_t t = 0; t < count; ++t)
    if (is_set(c.lightmap.validity[page * count + t]))
      for (size_t k = 0; k < 3; ++k) rgb[3 * t + k] = byte_of(plane[page * count + t]);
  return encode_png(c.atlas.width, c.atlas.height, rgb);
}

struct LogRange {
  double low = 0, span = 1;
};

double epic_light(const Vec3& e) {
  return double{max_component(e)} * kInvPi / kEpicDirectionality;
}

LogRange log_range(const OutputContext& c, uint32_t page) {
  const size_t count = size_t{c.atlas.width} * c.atlas.height;
  double most = 0;
  for (size_t t = 0; t < count; ++t)
    most = std::max(most, epic_light(irradiance_of(c.lightmap, page * count + t)));
  const double low = logarithm2(kEpicBlack);
  return {low, std::max(1.0, logarithm2(most + kEpicBlack) - low)};
}

Expected<Bytes> epic_page(const OutputContext& c, uint32_t page, const LogRange& range) {
  const size_t count = size_t{c.atlas.width} * c.atlas.height;
  std::vector<uint8_t> rgba(8 * count, 128);
  for (size_t t = 0; t < count; ++t) {
    const Vec3 e = irradiance_of(c.lightmap, page * count + t);
    const double light = epic_light(e);
    for (size_t k = 0; k < 3; ++k)
      rgba[4 * t + k] = light > 0 ? byte_of(std::sqrt(double{e[static_cast<int>(k)]} / max_component(e))) : 0;
    // 255 v + 1/2 = high + low/255, in stored bytes.
    const double code = 255 * (logarithm2(light + kEpicBlack) - range.low) / range.span + 0.5;
    const double high = std::clamp(std::floor(code), 0.0, 255.0);
    rgba[4 * t + 3] = static_cast<uint8_t>(high);
    rgba[4 * (count + t) + 3] = byte_of(code - high);
  }
  return encode_png(c.atlas.width, 2 * c.atlas.height, rgba, 4);
}

// The share of the range that each alpha stands for.
const std::array<double, 256>& mx_shares() {
  static const std::array<double, 256> shares = [] {
    std::array<double, 256> out{};
    for (size_t a = 1; a < 256; ++a) out[a] = double{power(static_cast<float>(a) / 255, kMxPower)};
    out[255] = 1;
    return out;
  }();
  return shares;
}

// The intensity with which the brightest texel of the map is the brightest code.
double mx_intensity(const OutputContext& c) {
  float most = 0;
  for (size_t t = 0; t < c.lightmap.validity.size(); ++t)
    most = std::max(most, max_component(irradiance_of(c.lightmap, t)));
  return most > 0 ? most / kMxRange : 1;
}

Expected<Bytes> mx_page(const OutputContext& c, uint32_t page, double intensity) {
  const std::array<double, 256>& shares = mx_shares();
  const double range = kMxRange * intensity;  // in double: a float's inverse may be infinite
  const size_t count = size_t{c.atlas.width} * c.atlas.height;
  std::vector<uint8_t> rgba(4 * count);
  for (size_t t = 0; t < count; ++t) {
    const Vec3 e = irradiance_of(c.lightmap, page * count + t);
    // The least alpha that holds the largest component. Black has 1, so that no reader divides by 0.
    const auto alpha = std::lower_bound(shares.begin() + 1, shares.end() - 1, max_component(e) / range);
    for (size_t k = 0; k < 3; ++k) rgba[4 * t + k] = byte_of(e[static_cast<int>(k)] / (range * *alpha));
    rgba[4 * t + 3] = static_cast<uint8_t>(alpha - shares.begin());
  }
  return encode_png(c.atlas.width, c.atlas.height, rgba, 4);
}

}  // namespace

Status GltfOutput::attach_material_maps() {
  const bool moz = c_->settings.gltf_lightmap.moz && has_planes(*c_);
  const std::vector<float>* occlusion = occlusion_plane(*c_);
  if (!moz && !occlusion) return {};
  PageMaterials materials(doc);
  // Primitives without a lightmap keep the material unchanged.
  for (const bool lit : {false, true})
    for (Json& mesh : doc["meshes"])
      for (Json& primitive : mesh["primitives"]) {
        const int page = page_of(primitive);
        if ((page != kNoPage) != lit) continue;
        for_each_material(primitive, [&](Json& holder) {
          if (lit || holder.contains("material")) holder["material"] = materials.of(holder, page);
        });
      }
  const float intensity = moz ? brightest(*c_) : 1.0f;
  std::map<int, size_t> light, shade;  // textures by page
  for (const auto& [key, place] : materials.made()) {
    const int page = key.second;
    if (page == kNoPage || is_unlit(doc["materials"][place])) continue;
    if (moz) {
      if (!light.count(page)) {
        KILN_TRY(const Bytes png, moz_page(*c_, static_cast<uint32_t>(page), intensity));
        light[page] = buffer.add_page_texture(doc, png, "lightmap page " + std::to_string(page));
      }
      doc["materials"][place]["extensions"][kMoz] = {
          {"index", light[page]}, {"texCoord", 1}, {"intensity", intensity}};
    }
    // A material's own occlusion map stays: it has finer detail than the atlas.
    if (occlusion && !doc["materials"][place].contains("occlusionTexture")) {
      if (!shade.count(page)) {
        KILN_TRY(const Bytes png, occlusion_page(*c_, static_cast<uint32_t>(page), *occlusion));
        shade[page] = buffer.add_page_texture(doc, png, "ambient occlusion page " + std::to_string(page));
      }
      doc["materials"][place]["occlusionTexture"] = {{"index", shade[page]}, {"texCoord", 1}};
    }
  }
  if (!light.empty()) use_extension(doc, kMoz);
  return {};
}

std::vector<int> GltfOutput::split_nodes_by_page() {
  std::vector<int> pages(doc["nodes"].size(), kNoPage);
  const size_t nodes = doc["nodes"].size();
  for (size_t n = 0; n < nodes; ++n) {
    if (!doc["nodes"][n].contains("mesh")) continue;
    const size_t mesh = doc["nodes"][n]["mesh"];
    std::map<int, Json> by_page;
    for (const Json& primitive : doc["meshes"][mesh]["primitives"])
      by_page[page_of(primitive)].push_back(primitive);
    bool first = true;
    for (auto& [page, primitives] : by_page) {
      if (first) {
        pages[n] = page;
      } else {  // a child at the same position, with the primitives of this page
        const size_t child = doc["nodes"].size();
        Json part = doc["meshes"][mesh];
        part["primitives"] = primitives;
        doc["meshes"].push_back(std::move(part));
        doc["nodes"].push_back({{"mesh", doc["meshes"].size() - 1}});
        doc["nodes"][n]["children"].push_back(child);
        if (page != kNoPage)
          doc["nodes"][child]["extensions"][kKilnLightmap] = {{"lightmap", 0}, {"pages", {page}}};
        pages.push_back(page);
      }
      first = false;
    }
    if (by_page.size() > 1) {
      doc["meshes"][mesh]["primitives"] = by_page.begin()->second;
      const int page = by_page.begin()->first;
      if (page == kNoPage)
        doc["nodes"][n]["extensions"].erase(kKilnLightmap);
      else
        doc["nodes"][n]["extensions"][kKilnLightmap]["pages"] = {page};
      if (doc["nodes"][n]["extensions"].empty()) doc["nodes"][n].erase("extensions");
    }
  }
  return pages;
}

Status GltfOutput::attach_node_lightmaps() {
  const GltfLightmaps& which = c_->settings.gltf_lightmap;
  if ((!which.epic && !which.mx) || !has_planes(*c_) || !doc.contains("nodes")) return {};
  const std::vector<int> pages = split_nodes_by_page();
  if (which.epic) KILN_TRY_STATUS(attach_epic_lightmap(pages));
  if (which.mx) KILN_TRY_STATUS(attach_mx_lightmap(pages));
  return {};
}

Status GltfOutput::attach_epic_lightmap(const std::vector<int>& pages) {
  Json lightmaps = Json::array();
  for (uint32_t page = 0; page < c_->atlas.pages; ++page) {
    const LogRange range = log_range(*c_, page);
    KILN_TRY(const Bytes png, epic_page(*c_, page, range));
    const std::string name = "lightmap page " + std::to_string(page) + ", Unreal's layout";
    lightmaps.push_back({{"name", name},
                         {"texture", {{"index", buffer.add_page_texture(doc, png, name)}, {"texCoord", 1}}},
                         {"lightmapScale", {1.0, 1.0, 1.0, range.span}},
                         {"lightmapAdd", {0.0, 0.0, 0.0, range.low}},
                         {"coordinateScaleBias", {1.0, 1.0, 0.0, 0.0}}});
  }
  for (size_t n = 0; n < pages.size(); ++n)
    if (pages[n] != kNoPage) doc["nodes"][n]["extensions"][kEpic] = {{"lightmap", pages[n]}};
  doc["extensions"][kEpic] = {{"lightmaps", lightmaps}};
  use_extension(doc, kEpic);
  return {};
}

Status GltfOutput::attach_mx_lightmap(const std::vector<int>& pages) {
  const double intensity = mx_intensity(*c_);
  std::map<int, size_t> textures;  // by page
  for (size_t n = 0; n < pages.size(); ++n) {
    const int page = pages[n];
    if (page == kNoPage) continue;
    if (!textures.count(page)) {
      KILN_TRY(const Bytes png, mx_page(*c_, static_cast<uint32_t>(page), intensity));
      textures[page] =
          buffer.add_page_texture(doc, png, "lightmap page " + std::to_string(page) + ", Unity's RGBM");
    }
    doc["nodes"][n]["extensions"][kMx] = {{"lightMapTexture", {{"index", textures[page]}, {"texCoord", 1}}},
                                          {"scale", {1.0, 1.0}},
                                          {"offset", {0.0, 0.0}},
                                          {"intensity", intensity}};
  }
  if (!textures.empty()) use_extension(doc, kMx);
  return {};
}

}  // namespace kiln
