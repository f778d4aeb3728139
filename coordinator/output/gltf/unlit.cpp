// scene_unlit.glb: the lit scene for viewers without lightmaps. Base colour x E / pi plus emission, exposed
// and tone-mapped with the filmic curve, become base-colour textures of unlit materials; their only
// coordinates are the lightmap's. Objects without texels keep their own textures and are unlit in the median
// light of the others' texels (preview.png: of the pixels shown). Lamps would light nothing, so there are
// none.
#include <cmath>

#include "common/base/parallel.h"
#include "common/raster/triangle2.h"
#include "coordinator/output/gltf/output_file.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/output/look/tone.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

// Import keeps four texels of a texture along each edge of a lightmap texel, so finer images would show no
// more.
constexpr uint32_t kFinest = 4, kLargestSide = 4096;

class PagePicture {
 public:
  PagePicture(const OutputContext& c, const SurfaceLook& look, uint32_t page, float exposure)
      : c_(c), look_(look), page_(page), exposure_(exposure) {
    const uint32_t side = std::max(c.atlas.width, c.atlas.height);
    fine_ = std::clamp(kLargestSide / side, 1u, kFinest);
    width_ = c.atlas.width * fine_;
    height_ = c.atlas.height * fine_;
    rgba_.assign(size_t{4} * width_ * height_, 0);
    set_.assign(size_t{width_} * height_, 0);
    for (uint32_t top = 0; top < height_; top += rows_of_a_band())
      bands_.push_back({top, std::min(height_, top + rows_of_a_band())});
  }

  Expected<Bytes> draw() {
    parallel_for(bands_.size(), [&](size_t b) {
      for (uint32_t i = 0; i < c_.scene.instances.size(); ++i) draw_instance(i, bands_[b]);
    });
    for (uint32_t step = 0; step < fine_ * 2; ++step) dilate();
    return encode_png(width_, height_, rgba_, 4);
  }

 private:
  struct Band {
    uint32_t top, bottom;  // rows [top, bottom)
  };

  // Every band walks all faces, so that there are no more bands than threads.
  uint32_t rows_of_a_band() const { return (height_ + hardware_threads() - 1) / hardware_threads(); }

  void draw_instance(uint32_t i, const Band& band) {
    const MeshCharts& charts = c_.atlas.of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const ChartPlacement& place =
          c_.atlas.placements[c_.atlas.instance_first_chart[i] + charts.chart_of_face[f]];
      if (place.page == page_) draw_face(i, charts, place, f, band);
    }
  }

  void draw_face(uint32_t i, const MeshCharts& charts, const ChartPlacement& place, size_t face,
                 const Band& band) {
    Triangle2 t = texel_triangle(charts, place, face);
    for (DVec2& corner : t.c) corner *= static_cast<double>(fine_);
    const double area = area2(t);
    if (area == 0) return;
    DVec2 b[3] = {{0, 0}, {1, 0}, {0, 1}};  // barycentrics of the whole triangle
    if (!charts.parts.empty())
      for (int k = 0; k < 3; ++k) b[k] = DVec2(charts.parts[face].corner[k]);
    const auto first = [](double low) { return static_cast<uint32_t>(std::max(0.0, std::floor(low - 0.5))); };
    const uint32_t right = std::min(width_, first(t.max_x()) + 2),
                   bottom = std::min(band.bottom, first(t.max_y()) + 2);
    for (uint32_t y = std::max(band.top, first(t.min_y())); y < bottom; ++y)
      for (uint32_t x = first(t.min_x()); x < right; ++x) {
        const DVec2 p(x + 0.5, y + 0.5);
        const double l0 = area2(t.c[1], t.c[2], p) / area, l1 = area2(t.c[2], t.c[0], p) / area;
        if (l0 < 0 || l1 < 0 || l0 + l1 > 1) continue;
        const DVec2 at = b[0] * l0 + b[1] * l1 + b[2] * (1 - l0 - l1);
        Fragment fragment;
        fragment.instance = i;
        fragment.triangle = charts.triangle_of(face);
        fragment.b1 = static_cast<float>(at.x);
        fragment.b2 = static_cast<float>(at.y);
        put(size_t{y} * width_ + x, fragment, Vec2(p / static_cast<double>(fine_)));
      }
  }

  void put(size_t texel, const Fragment& fragment, const Vec2& at) {
    Vec3 e(0.0f);
    look_.irradiance_at(page_, at, e);
    const Vec4 base = look_.base_color(fragment);
    const Vec3 radiance = Vec3(base) * e * kInvPi + look_.emission(fragment);
    for (int k = 0; k < 3; ++k)
      rgba_[4 * texel + static_cast<size_t>(k)] = linear_to_srgb8(filmic(radiance[k] * exposure_));
    rgba_[4 * texel + 3] = static_cast<uint8_t>(std::lround(255 * std::clamp(base.w, 0.0f, 1.0f)));
    set_[texel] = 1;
  }

  // Texels beside the charts get the mean of their neighbours, for bilinear lookups.
  void dilate() {
    std::vector<std::vector<size_t>> added(bands_.size());
    parallel_for(bands_.size(), [&](size_t b) { added[b] = dilate(bands_[b]); });
    for (const std::vector<size_t>& texels : added)
      for (const size_t texel : texels) set_[texel] = 1;
  }

  // Gives values to texels of the band that have none, and returns these; reads texels that have one alone.
  std::vector<size_t> dilate(const Band& band) {
    std::vector<size_t> added;
    for (uint32_t y = band.top; y < band.bottom; ++y)
      for (uint32_t x = 0; x < width_; ++x) {
        const size_t texel = size_t{y} * width_ + x;
        if (set_[texel]) continue;
        uint32_t sum[4] = {}, count = 0;
        for (int k = 0; k < 9; ++k) {
          const int64_t nx = int64_t{x} + k % 3 - 1, ny = int64_t{y} + k / 3 - 1;
          if (nx < 0 || ny < 0 || nx >= width_ || ny >= height_) continue;
          const size_t other = static_cast<size_t>(ny) * width_ + static_cast<size_t>(nx);
          if (!set_[other]) continue;
          for (size_t s = 0; s < 4; ++s) sum[s] += rgba_[4 * other + s];
          ++count;
        }
        if (count == 0) continue;
        for (size_t s = 0; s < 4; ++s)
          rgba_[4 * texel + s] = static_cast<uint8_t>((sum[s] + count / 2) / count);
        added.push_back(texel);
      }
    return added;
  }

  const OutputContext& c_;
  const SurfaceLook& look_;
  const uint32_t page_;
  const float exposure_;
  uint32_t fine_ = 1, width_ = 0, height_ = 0;
  std::vector<uint8_t> rgba_, set_;  // set_: 1 where a texel has a value; bytes, as threads share it
  std::vector<Band> bands_;
};

Json unlit_material(const Json& original, size_t texture) {
  Json made = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}, {"texCoord", 0}}}}},
               {"extensions", {{"KHR_materials_unlit", Json::object()}}}};
  for (const char* key : {"name", "doubleSided", "alphaMode", "alphaCutoff"})
    if (original.contains(key)) made[key] = original[key];
  return made;
}

// Median luminance of E over texels with a value.
float median_light(const OutputContext& c) {
  std::vector<float> light;
  const auto& planes = c.lightmap.planes.data;
  for (size_t t = 0; t < c.lightmap.validity.size(); ++t)
    if (is_set(c.lightmap.validity[t]))
      light.push_back(luminance(Vec3(planes[0][t], planes[1][t], planes[2][t])));
  if (light.empty()) return 0;
  const auto middle = light.begin() + static_cast<ptrdiff_t>(light.size() / 2);
  std::nth_element(light.begin(), middle, light.end());
  return *middle;
}

class UnlitWriter {
 public:
  UnlitWriter(const OutputContext& c, GltfOutput& scene)
      : c_(c),
        scene_(scene),
        look_(c.scene, c.atlas, c.lightmap),
        exposure_(viewing_exposure(c)),
        others_light_(median_light(c)) {}

  Status write() {
    Json& doc = scene_.doc;
    if (!doc.contains("materials")) doc["materials"] = Json::array();
    for (Json& mesh : doc["meshes"])
      for (Json& primitive : mesh["primitives"]) {
        const bool lit = primitive.contains("extensions") && primitive["extensions"].contains(kKilnLightmap);
        if (lit) {
          KILN_TRY_STATUS(draw_page(primitive["extensions"][kKilnLightmap]["page"]));
          keep_lightmap_coordinates(primitive["attributes"]);
        }
        const int page = lit ? primitive["extensions"][kKilnLightmap]["page"].get<int>() : kNoPage;
        primitive["material"] = material_of(primitive.value("material", SIZE_MAX), page);
      }
    for (const char* extension : {kKilnLightmap, "KHR_materials_variants"}) drop_extension(doc, extension);
    use_extension(doc, "KHR_materials_unlit");
    GltfOutput::note(doc) = {{"version", 1}, {"exposure", exposure_}, {"curve", "filmic"}};
    doc["asset"]["generator"] = program_name();
    scene_.drop_lamps();
    scene_.drop_unused_materials();
    return {};
  }

 private:
  static constexpr int kNoPage = -1;

  Status draw_page(uint32_t page) {
    if (textures_.count(page)) return {};
    KILN_TRY(const Bytes png, PagePicture(c_, look_, page, exposure_).draw());
    textures_[page] = scene_.buffer.add_page_texture(scene_.doc, png, "lit page " + std::to_string(page));
    return {};
  }

  static void keep_lightmap_coordinates(Json& attributes) {
    Json kept = {{"POSITION", attributes["POSITION"]}, {"TEXCOORD_0", attributes["TEXCOORD_1"]}};
    for (const char* key : {"NORMAL", "JOINTS_0", "WEIGHTS_0"})
      if (attributes.contains(key)) kept[key] = attributes[key];
    attributes = std::move(kept);
  }

  // `original`: SIZE_MAX for glTF's default material.
  size_t material_of(size_t original, int page) {
    Json& materials = scene_.doc["materials"];
    const auto [at, added] = made_.try_emplace({original, page}, materials.size());
    if (added) {
      const Json from = original == SIZE_MAX ? Json::object() : Json(materials[original]);
      materials.push_back(page == kNoPage ? other_material(from)
                                          : unlit_material(from, textures_[static_cast<uint32_t>(page)]));
    }
    return at->second;
  }

  // One factor cannot follow the curve: it is right for a base colour of 0.5.
  Json other_material(const Json& original) const {
    constexpr float kMiddleAlbedo = 0.5f;
    const bool unlit = original.contains("extensions") &&
                       original["extensions"].contains("KHR_materials_unlit");  // emits its colour
    const float light = exposure_ * (unlit ? 1.0f : others_light_ * kInvPi);
    const float shown = filmic(kMiddleAlbedo * light) / kMiddleAlbedo;
    Json made = {{"extensions", {{"KHR_materials_unlit", Json::object()}}}};
    for (const char* key : {"name", "doubleSided", "alphaMode", "alphaCutoff"})
      if (original.contains(key)) made[key] = original[key];
    const Json pbr = original.value("pbrMetallicRoughness", Json::object());
    Json& kept = made["pbrMetallicRoughness"] = Json::object();
    if (pbr.contains("baseColorTexture")) kept["baseColorTexture"] = pbr["baseColorTexture"];
    Json colour = pbr.value("baseColorFactor", Json{1.0, 1.0, 1.0, 1.0});
    for (size_t k = 0; k < 3; ++k) {
      double emission = 0;
      if (original.contains("emissiveFactor")) emission = original["emissiveFactor"].at(k).get<double>();
      const double value = colour.at(k).get<double>() * double{shown} +
                           double{filmic(static_cast<float>(emission) * exposure_)};
      colour[k] = std::clamp(value, 0.0, 1.0);
    }
    kept["baseColorFactor"] = std::move(colour);
    return made;
  }

  const OutputContext& c_;
  GltfOutput& scene_;
  const SurfaceLook look_;
  const float exposure_, others_light_;
  std::map<uint32_t, size_t> textures_;            // by page
  std::map<std::pair<size_t, int>, size_t> made_;  // by material of the file and page
};

Expected<Bytes> write(const OutputContext& c) {
  KILN_TRY(GltfOutput scene, open_lit_scene(c));
  KILN_TRY_STATUS(UnlitWriter(c, scene).write());
  return scene.finish("scene_unlit.glb");
}

}  // namespace

Expected<std::vector<std::string>> write_gltf_unlit(const OutputContext& c) {
  if (!c.settings.embed_basecolor || !c.lightmap.has_light) return std::vector<std::string>{};
  return publish_glb(c, "scene_unlit.glb", write);
}

}  // namespace kiln
