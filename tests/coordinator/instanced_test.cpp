// scene_instanced.glb and the chart table against scene.glb: the arithmetic of docs/engines.md gives every
// vertex the TEXCOORD_1 that the simple form has.
#include <cstring>
#include <map>

#include "common/base/files.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/encode/output.h"
#include "coordinator/scene/document/glb.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::json;

struct Glb {
  json doc;
  Bytes binary;

  explicit Glb(const std::filesystem::path& path) {
    const Bytes file = *read_file(path);
    const GlbParts parts = *read_glb(file, "test");
    doc = json::parse(parts.json);
    binary.assign(parts.binary->begin(), parts.binary->end());
  }
  // Floats of an accessor, `width` to an element.
  std::vector<float> floats(const json& accessor, size_t width) const {
    const json& a = doc["accessors"][accessor.get<size_t>()];
    EXPECT_EQ(a["componentType"], 5126);
    const json& view = doc["bufferViews"][a["bufferView"].get<size_t>()];
    const size_t stride = view.value("byteStride", 4 * width);
    const size_t begin = view.value("byteOffset", size_t{0}) + a.value("byteOffset", size_t{0});
    std::vector<float> out(a["count"].get<size_t>() * width);
    for (size_t i = 0; i < out.size() / width; ++i)
      std::memcpy(&out[i * width], binary.data() + begin + i * stride, 4 * width);
    return out;
  }
};

// What an engine keeps of charts.bin, by the offsets that docs/engines.md gives.
struct Table {
  uint32_t version, width, height, pages, instances, charts;
  std::vector<uint32_t> first_chart;
  struct Entry {
    float scale[2], offset[2];
    uint32_t page, turned;
  };
  std::vector<Entry> entries;

  explicit Table(const Bytes& b) {
    EXPECT_EQ(std::memcmp(b.data(), "KILNCHRT", 8), 0);
    uint64_t at[2];
    std::memcpy(&version, b.data() + 8, 24);
    std::memcpy(at, b.data() + 32, 16);
    EXPECT_EQ(at[0] % 256, 0u);
    EXPECT_EQ(at[1] % 256, 0u);
    first_chart.resize(instances + 1);
    std::memcpy(first_chart.data(), b.data() + at[0], 4 * first_chart.size());
    entries.resize(charts);
    EXPECT_EQ(b.size(), at[1] + 24 * uint64_t{charts});
    std::memcpy(entries.data(), b.data() + at[1], 24 * entries.size());
  }
};

struct Vertex {
  Vec3 position;
  Vec2 uv;
  float slack = 0;  // how far rounding may take it, in uv
  bool operator==(const Vertex&) const = default;
};
using Place = std::array<float, 4>;  // translation, primitive
using Vertices = std::map<Place, std::vector<Vertex>>;

constexpr float kHalfUlp = 0x1p-24f;  // relative

// The snippet of docs/engines.md. `slack`: box coordinate, scale, their product, offset and sum are rounded
// once each here; texels and their quotient by the page once each in scene.glb.
void look_up(const Table::Entry& t, const Vec2& uv, Vertex& v) {
  const Vec2 turned = t.turned ? Vec2(uv.y, uv.x) : uv;
  v.uv = turned * Vec2(t.scale[0], t.scale[1]) + Vec2(t.offset[0], t.offset[1]);
  for (int k = 0; k < 2; ++k)
    v.slack = std::max(
        v.slack, 1.001f * kHalfUlp *
                     (3 * std::abs(turned[k] * t.scale[k]) + std::abs(t.offset[k]) + 3 * std::abs(v.uv[k])));
}

// Walks translations only, as the test scenes have them. `table`: the file's coordinates are in chart boxes.
void collect(const Glb& glb, size_t node, Vec3 at, const Table* table, Vertices& out) {
  const json& n = glb.doc["nodes"][node];
  if (n.contains("translation"))
    for (int k = 0; k < 3; ++k) at[k] += n["translation"][static_cast<size_t>(k)].get<float>();
  if (n.contains("matrix"))
    for (int k = 0; k < 3; ++k) at[k] += n["matrix"][static_cast<size_t>(12 + k)].get<float>();
  for (const json& child : n.value("children", json::array())) collect(glb, child, at, table, out);
  if (!n.contains("mesh")) return;
  std::vector<float> copies{0, 0, 0}, first;
  if (n.contains("extensions") && n["extensions"].contains("EXT_mesh_gpu_instancing")) {
    const json& attributes = n["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    copies = glb.floats(attributes["TRANSLATION"], 3);
    first = glb.floats(attributes["_FIRST_CHART"], 1);
    ASSERT_EQ(first.size() * 3, copies.size());
  } else if (table) {
    first.push_back(n["extras"]["kiln"]["first_chart"].get<float>());
  }
  const json& primitives = glb.doc["meshes"][n["mesh"].get<size_t>()]["primitives"];
  for (size_t c = 0; c < copies.size() / 3; ++c)
    for (size_t p = 0, first_part = 0, number = 0; p < primitives.size(); ++p) {
      // Parts of one primitive on several pages share their vertices.
      if (primitives[p]["attributes"] != primitives[first_part]["attributes"]) {
        first_part = p;
        ++number;
      }
      if (p != first_part) continue;
      const Vec3 origin = at + Vec3(copies[3 * c], copies[3 * c + 1], copies[3 * c + 2]);
      const json& a = primitives[p]["attributes"];
      const auto position = glb.floats(a["POSITION"], 3), uv = glb.floats(a["TEXCOORD_1"], 2);
      const auto chart = table ? glb.floats(a["_CHART"], 1) : std::vector<float>{};
      std::vector<Vertex>& list = out[{origin.x, origin.y, origin.z, static_cast<float>(number)}];
      EXPECT_TRUE(list.empty());
      for (size_t v = 0; v < uv.size() / 2; ++v) {
        Vertex made{origin + Vec3(position[3 * v], position[3 * v + 1], position[3 * v + 2]),
                    {uv[2 * v], uv[2 * v + 1]}};
        if (table) {
          for (int k = 0; k < 2; ++k) EXPECT_TRUE(made.uv[k] >= 0 && made.uv[k] <= 1);
          look_up(table->entries.at(static_cast<size_t>(first[c]) + static_cast<size_t>(chart[v])), made.uv,
                  made);
        }
        list.push_back(made);
      }
    }
}

Vertices vertices(const Glb& glb, const Table* table) {
  Vertices out;
  for (const json& root : glb.doc["scenes"][0]["nodes"]) collect(glb, root, Vec3(0.0f), table, out);
  return out;
}

size_t meshes_in_use(const Glb& glb) {
  std::set<size_t> used;
  for (const json& node : glb.doc["nodes"])
    if (node.contains("mesh")) used.insert(node["mesh"].get<size_t>());
  return used.size();
}

// A bench of two primitives (a tent and a slab) that stands twice; four floors by EXT_mesh_gpu_instancing, of
// which the first has a wall on it; the wall.
test::GltfBuilder street() {
  test::GltfBuilder b;
  const int tent = b.vec3({0, 0, 0, 2, 0, 0, 2, 1, 1, 0, 1, 1, 2, 0, 2, 0, 0, 2});
  const int slab = b.vec3({0, 3, 0, 0, 3, 1, 3, 3, 1, 3, 3, 0});
  const std::vector<uint16_t> folded{0, 2, 1, 0, 3, 2, 3, 4, 2, 3, 5, 4}, flat{0, 1, 2, 0, 2, 3};
  const int bench =
      b.mesh({{"attributes", {{"POSITION", tent}}}, {"indices", b.accessor_of(folded, 5123, "SCALAR", 1)}});
  b.root["meshes"][bench]["primitives"].push_back(
      {{"attributes", {{"POSITION", slab}}}, {"indices", b.accessor_of(flat, 5123, "SCALAR", 1)}});
  const int floor = b.mesh({{"attributes", {{"POSITION", b.vec3({0, 0, 0, 0, 0, 6, 6, 0, 6, 6, 0, 0})}}},
                            {"indices", b.accessor_of(flat, 5123, "SCALAR", 1)}});
  const int wall =
      b.mesh({{"attributes", {{"POSITION", b.vec3({2.25f, 0, -1, 2.25f, 0, 5, 2.25f, 2, 5, 2.25f, 2, -1})}}},
              {"indices", b.accessor_of(flat, 5123, "SCALAR", 1)}});
  b.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  b.node({{"mesh", bench}, {"translation", {0, 8, 0}}, {"extras", "a remark"}});
  b.node({{"mesh", bench}, {"translation", {8, 8, 0}}});
  const int places = b.vec3({0, 0, 0, 20, 0, 0, 40, 0, 0, 60, 0, 0});
  b.node({{"mesh", floor},
          {"translation", {0, 0, 64}},
          {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}}}});
  b.node({{"mesh", wall}, {"translation", {0, 0, 65}}});
  return b;
}

void take_wall(test::GltfBuilder& b) {
  b.root["nodes"].erase(3);
  b.root["scenes"][0]["nodes"].erase(3);
}

class Instanced : public testing::Test {
 protected:
  void write(const test::GltfBuilder& builder, uint32_t page_size = 8192) {
    auto read = import_scene(test::write_glb_file(builder, dir_.path()), {});
    ASSERT_TRUE(read) << read.error().message;
    before_ = std::move(*read);
    AtlasSettings settings;
    settings.layout = AtlasSettings::Layout::kPack;
    settings.max_page_size = page_size;
    atlas_ = *build_atlas(before_.scene, settings);
    BakeSettings bake;
    bake.instanced = true;
    const Lightmap map;
    const OutputContext context{bake, before_.scene, atlas_, before_.document, map, dir_.path()};
    for (const auto write : {write_gltf, write_gltf_instanced, write_charts}) {
      const auto names = write(context);
      ASSERT_TRUE(names) << names.error().message;
      EXPECT_FALSE(names->empty());
    }
  }
  Table table() const { return Table(*read_file(dir_.path() / "charts.bin")); }

  void expect_equal() {
    const Table t = table();
    const Vertices simple = vertices(Glb(dir_.path() / "scene.glb"), nullptr);
    const Vertices by_table = vertices(Glb(dir_.path() / "scene_instanced.glb"), &t);
    ASSERT_EQ(simple.size(), before_.scene.instances.size());
    ASSERT_EQ(by_table.size(), simple.size());
    for (const auto& [place, list] : simple) {
      const auto found = by_table.find(place);
      ASSERT_NE(found, by_table.end()) << place[0] << " " << place[1] << " " << place[2];
      ASSERT_EQ(found->second.size(), list.size());
      for (size_t v = 0; v < list.size(); ++v) {
        EXPECT_EQ(found->second[v].position, list[v].position);
        EXPECT_NEAR(found->second[v].uv.x, list[v].uv.x, found->second[v].slack);
        EXPECT_NEAR(found->second[v].uv.y, list[v].uv.y, found->second[v].slack);
      }
    }
  }

  test::TempDir dir_;
  ImportResult before_;
  Atlas atlas_;
};

TEST_F(Instanced, TheTableGivesEveryVertexItsCoordinates) {
  write(street());
  ASSERT_EQ(atlas_.statistics.cut_charts, 1u);
  bool turned = false;
  for (const ChartPlacement& p : atlas_.placements) turned |= p.turned != 0;
  EXPECT_TRUE(turned) << "no chart is turned: the scene does not test that";
  expect_equal();
}

TEST_F(Instanced, OnSeveralPages) {
  write(street(), 32);
  EXPECT_GT(atlas_.pages, 1u);
  expect_equal();
  const Table t = table();
  for (size_t p = 0; p < t.entries.size(); ++p) EXPECT_EQ(t.entries[p].page, atlas_.placements[p].page);
}

TEST_F(Instanced, EveryMeshIsThereOnceAndInstancesStayTogether) {
  write(street());
  const Glb simple(dir_.path() / "scene.glb"), once(dir_.path() / "scene_instanced.glb");
  EXPECT_EQ(meshes_in_use(simple), 7u);
  EXPECT_EQ(meshes_in_use(once), 4u);          // bench, floor, the floor that is cut, wall
  EXPECT_EQ(simple.doc["meshes"].size(), 7u);  // none is left over
  EXPECT_EQ(once.doc["meshes"].size(), 4u);
  std::multiset<size_t> copies;
  for (const json& node : once.doc["nodes"])
    if (node.contains("extensions") && node["extensions"].contains("EXT_mesh_gpu_instancing"))
      copies.insert(
          once.floats(node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"], 3).size() /
          3);
  EXPECT_EQ(copies, (std::multiset<size_t>{1, 3}));
  EXPECT_EQ(once.doc["nodes"][0]["extras"]["value"], "a remark");
  const auto again = import_scene(dir_.path() / "scene_instanced.glb", {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->scene.instances.size(), before_.scene.instances.size());
}

TEST_F(Instanced, InstancesThatAreAlikeKeepTheirNodeAsItIs) {
  test::GltfBuilder b = street();
  take_wall(b);  // and so no cut
  write(b);
  const Glb once(dir_.path() / "scene_instanced.glb");
  EXPECT_EQ(meshes_in_use(once), 2u);
  EXPECT_EQ(once.doc["nodes"].size(), b.root["nodes"].size());
  expect_equal();
}

TEST_F(Instanced, ANodeOutsideTheSceneKeepsItsMesh) {
  test::GltfBuilder b = street();
  const json before = b.root["meshes"][0];
  b.root["nodes"].push_back({{"mesh", 0}});
  write(b);
  for (const char* name : {"scene.glb", "scene_instanced.glb"}) {
    const Glb glb(dir_.path() / name);
    EXPECT_EQ(glb.doc["meshes"][glb.doc["nodes"][4]["mesh"].get<size_t>()], before) << name;
  }
  expect_equal();
}

TEST_F(Instanced, ACopyWithoutExtentLeavesTheOthersTheirPlaces) {
  test::GltfBuilder b = street();
  take_wall(b);
  const int scales = b.vec3({1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1});
  b.root["nodes"][2]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = scales;
  write(b);
  EXPECT_EQ(before_.scene.instances.size(), 7u);
  expect_equal();
}

TEST_F(Instanced, NothingIsWrittenUnlessAskedForOrInLayoutAtlas) {
  Atlas atlas;
  atlas.width = atlas.height = 1;
  BakeSettings bake;
  const Scene scene;
  const GltfDocument document;
  const Lightmap map;
  for (const bool instanced : {false, true}) {
    bake.instanced = instanced;
    atlas.packed = !instanced;
    EXPECT_TRUE(write_gltf_instanced({bake, scene, atlas, document, map, dir_.path()})->empty());
  }
  EXPECT_TRUE(write_charts({bake, scene, atlas, document, map, dir_.path()})->empty());
}

// glTF validator: ACCESSOR_MIN_MISMATCH, ACCESSOR_MAX_MISMATCH;
// MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS.
TEST_F(Instanced, PositionsStateTheirOwnBounds) {
  test::GltfBuilder b = street();
  // The slab shares one accessor with points that it does not use.
  const int wide = b.vec3({-9, -9, -9, 0, 3, 0, 0, 3, 1, 3, 3, 1, 3, 3, 0, 9, 9, 9});
  b.root["accessors"][wide]["min"] = {-9, -9, -9};
  b.root["accessors"][wide]["max"] = {9, 9, 9};
  const int normals = b.vec3({0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0});
  b.root["accessors"][normals]["min"] = {0, 1, 0};
  const std::vector<uint16_t> flat{1, 2, 3, 1, 3, 4};
  b.root["meshes"][0]["primitives"][1] = {{"attributes", {{"POSITION", wide}, {"NORMAL", normals}}},
                                          {"indices", b.accessor_of(flat, 5123, "SCALAR", 1)}};
  write(b);
  for (const char* name : {"scene.glb", "scene_instanced.glb"}) {
    const Glb glb(dir_.path() / name);
    size_t checked = 0;
    for (const json& node : glb.doc["nodes"]) {
      if (!node.contains("mesh")) continue;
      for (const json& p : glb.doc["meshes"][node["mesh"].get<size_t>()]["primitives"]) {
        const json& accessor = glb.doc["accessors"][p["attributes"]["POSITION"].get<size_t>()];
        const std::vector<float> values = glb.floats(p["attributes"]["POSITION"], 3);
        for (size_t c = 0; c < 3; ++c) {
          float low = values[c], high = values[c];
          for (size_t i = c; i < values.size(); i += 3) {
            low = std::min(low, values[i]);
            high = std::max(high, values[i]);
          }
          EXPECT_EQ(accessor["min"][c].get<float>(), low) << name;
          EXPECT_EQ(accessor["max"][c].get<float>(), high) << name;
        }
        ++checked;
        if (!p["attributes"].contains("NORMAL")) continue;
        const json& normal = glb.doc["accessors"][p["attributes"]["NORMAL"].get<size_t>()];
        EXPECT_FALSE(normal.contains("min") || normal.contains("max")) << name;
      }
    }
    EXPECT_GT(checked, 4u);
  }
}

}  // namespace
}  // namespace kiln
