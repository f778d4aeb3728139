#include "tests/bake/scene_gltf.h"

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/json.h"
#include "coordinator/scene/document/gltf_document.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {
namespace {

struct View {
  size_t offset, length, count;
  const char* type;
  int component;
};

void write_matrix(JsonWriter& w, const Mat4x3& m) {
  w.key("matrix").begin_array();
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) w.value(static_cast<double>(m[c][r]));
    w.value(c == 3 ? 1.0 : 0.0);
  }
  w.end_array();
}

void write_material(JsonWriter& w, const Record& record) {
  const auto numbers = [&](const char* name, std::vector<double> fallback) {
    const Property* p = record.find(name);
    return p ? p->numbers : fallback;
  };
  const auto array = [&](const char* key, const std::vector<double>& values) {
    w.key(key).begin_array();
    for (double v : values) w.value(v);
    w.end_array();
  };
  w.begin_object().pair("name", record.name).key("pbrMetallicRoughness").begin_object();
  array("baseColorFactor", numbers("base_color", {1, 1, 1, 1}));
  w.pair("metallicFactor", numbers("metallic", {1})[0])
      .pair("roughnessFactor", numbers("roughness", {1})[0])
      .end_object();
  const std::vector<double> emission = numbers("emission", {0, 0, 0});
  const double strength = std::max({1.0, emission[0], emission[1], emission[2]});
  array("emissiveFactor", {emission[0] / strength, emission[1] / strength, emission[2] / strength});
  w.pair("doubleSided", numbers("double_sided", {0})[0] != 0);
  w.key("extensions").begin_object();
  w.key("KHR_materials_emissive_strength").begin_object().pair("emissiveStrength", strength).end_object();
  if (record.find("specular"))
    w.key("KHR_materials_specular")
        .begin_object()
        .pair("specularFactor", numbers("specular", {1})[0])
        .end_object();
  w.end_object().end_object();
}

void write_lights(JsonWriter& w, const Scene& scene) {
  w.key("KHR_lights_punctual").begin_object().key("lights").begin_array();
  for (const Record& light : scene.lights) {
    const double intensity = light.find("intensity") ? light.find("intensity")->numbers[0] : 1;
    Vec3 color(1.0f);
    if (const Property* p = light.find("color")) color = Vec3(p->numbers[0], p->numbers[1], p->numbers[2]);
    const double scale = std::max(1.0f, max_component(color));
    w.begin_object().pair("type", light.type).pair("intensity", intensity * scale).key("color").begin_array();
    for (int c = 0; c < 3; ++c) w.value(color[c] / scale);
    w.end_array();
    if (light.type == "spot") w.key("spot").begin_object().end_object();
    w.end_object();
  }
  w.end_array().end_object();
}

}  // namespace

void write_scene_glb(const Scene& scene, const std::filesystem::path& path) {
  Bytes buffer;
  std::vector<View> views;
  const auto add = [&](const auto& data, size_t count, const char* type, int component) {
    const auto bytes = bytes_of(data);
    views.push_back({buffer.size(), bytes.size(), count, type, component});
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
    return views.size() - 1;
  };
  JsonWriter w;
  w.begin_object().key("asset").begin_object().pair("version", "2.0").end_object();
  w.key("extensionsUsed")
      .begin_array()
      .value("KHR_lights_punctual")
      .value("KHR_materials_emissive_strength")
      .value("KHR_materials_specular")
      .end_array();
  w.key("meshes").begin_array();
  std::vector<uint32_t> material(scene.meshes.size(), 0);
  for (const Instance& i : scene.instances) material[i.mesh] = i.material;
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    w.begin_object()
        .pair("name", mesh.name)
        .key("primitives")
        .begin_array()
        .begin_object()
        .key("attributes")
        .begin_object();
    w.pair("POSITION", uint64_t{add(mesh.positions, mesh.positions.size(), "VEC3", 5126)});
    w.pair("NORMAL", uint64_t{add(mesh.normals, mesh.normals.size(), "VEC3", 5126)});
    if (!mesh.uv[1].empty()) w.pair("TEXCOORD_1", uint64_t{add(mesh.uv[1], mesh.uv[1].size(), "VEC2", 5126)});
    w.end_object().pair("indices", uint64_t{add(mesh.triangles, 3 * mesh.triangles.size(), "SCALAR", 5125)});
    w.pair("material", material[m]).end_object().end_array().end_object();
  }
  w.end_array().key("materials").begin_array();
  for (const Record& record : scene.materials) write_material(w, record);
  w.end_array().key("accessors").begin_array();
  for (size_t v = 0; v < views.size(); ++v)
    w.begin_object()
        .pair("bufferView", uint64_t{v})
        .pair("componentType", views[v].component)
        .pair("count", uint64_t{views[v].count})
        .pair("type", views[v].type)
        .end_object();
  w.end_array().key("bufferViews").begin_array();
  for (const View& v : views)
    w.begin_object()
        .pair("buffer", 0)
        .pair("byteOffset", uint64_t{v.offset})
        .pair("byteLength", uint64_t{v.length})
        .end_object();
  w.end_array()
      .key("buffers")
      .begin_array()
      .begin_object()
      .pair("byteLength", uint64_t{buffer.size()})
      .end_object()
      .end_array();
  w.key("nodes").begin_array();
  for (const Instance& i : scene.instances) {
    w.begin_object().pair("name", i.name).pair("mesh", i.mesh);
    if (!i.receive)
      w.key("extras")
          .begin_object()
          .key("kiln")
          .begin_object()
          .pair("receive", false)
          .end_object()
          .end_object();
    write_matrix(w, i.to_world);
    w.end_object();
  }
  for (size_t l = 0; l < scene.lights.size(); ++l) {
    w.begin_object();
    write_matrix(w, scene.lights[l].to_world);
    w.key("extensions")
        .begin_object()
        .key("KHR_lights_punctual")
        .begin_object()
        .pair("light", uint64_t{l})
        .end_object()
        .end_object()
        .end_object();
  }
  w.end_array().key("scenes").begin_array().begin_object().key("nodes").begin_array();
  for (size_t n = 0; n < scene.instances.size() + scene.lights.size(); ++n) w.value(uint64_t{n});
  w.end_array().end_object().end_array().pair("scene", 0);
  w.key("extensions").begin_object();
  write_lights(w, scene);
  w.end_object().end_object();
  KILN_CHECK(write_file_atomic(path, write_glb(w.take(), buffer)).has_value());
}

Scene small_room() {
  SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.7f, 0.6f, 0.5f));
  const uint32_t lamp = m.lambert(Vec3(0.2f), Vec3(6.0f, 5.0f, 3.0f));
  const uint32_t metal = m.metallic_roughness(Vec3(0.9f, 0.7f, 0.4f), 1, 0.3f);
  m.box({0, 0, 0}, {3, 2, 4}, true, wall);
  m.box({1, 0, 1}, {1.6f, 0.8f, 1.5f}, false, metal);
  m.quad({1, 1.9f, 2}, {0.8f, 0, 0}, {0, 0, 0.5f}, lamp);
  m.point({0.5f, 1.2f, 3.3f}, Vec3(1, 2, 3));
  Scene s = m.take();
  Instance twin = s.instances[7];  // one side of the box again, mirrored, elsewhere
  twin.to_world = Mat4x3(Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(3.4f, 0.2f, 1.5f));
  twin.name = "twin";
  s.instances.push_back(twin);
  return s;
}

}  // namespace kiln::test
