// MSFT_lod and extras.kiln.proxy in files: what stands, what is drawn, and files that make no sense.
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using namespace test;

// Meshes 0 to 2: one triangle each.
GltfBuilder with_nodes(const char* nodes, const char* roots) {
  GltfBuilder b;
  for (int i = 0; i < 3; ++i) b.triangle();
  b.root["nodes"] = json::parse(nodes);
  b.root["scenes"][0]["nodes"] = json::parse(roots);
  b.root["extensionsUsed"] = {"MSFT_lod"};
  return b;
}

std::string names(const ImportResult& r) {
  std::string out;
  for (const Instance& i : r.scene.instances) out += i.name + " ";
  return out;
}
std::string drawn(const ImportResult& r) {
  std::string out;
  for (const DisplayMesh& m : r.display.shown) out += m.place.name + std::to_string(m.level) + " ";
  return out;
}

const char* const kThree = R"([
    {"name": "parent", "children": [1, 4], "translation": [5, 0, 0]},
    {"name": "high", "mesh": 0, "translation": [1, 0, 0], "extensions": {"MSFT_lod": {"ids": [2, 3]}}},
    {"name": "mid", "mesh": 1, "translation": [1, 0, 0]},
    {"name": "low", "mesh": 2, "translation": [2, 0, 0]},
    {"name": "other", "mesh": 0}])";

TEST(Levels, OneIsBakedAndTheOthersTakeItsPlace) {
  const ImportResult r = imported(with_nodes(kThree, "[0]"));
  EXPECT_EQ(names(r), "other high ");
  EXPECT_EQ(drawn(r), "mid1 low2 ");
  ASSERT_EQ(r.display.sets.size(), 1u);
  EXPECT_EQ(r.display.sets[0].sources, std::vector<uint32_t>{1});
  EXPECT_EQ(r.display.sets[0].name, "node 1 'high'");
  EXPECT_EQ(r.display.sets[0].baked, "level 0");
  // Lower levels stand nowhere in the tree: they have the parent of their node.
  EXPECT_EQ(r.display.shown[0].place.to_world[3], Vec3(6, 0, 0));
  EXPECT_EQ(r.display.shown[1].place.to_world[3], Vec3(7, 0, 0));
  EXPECT_TRUE(r.display.is_drawn(1));
  EXPECT_FALSE(note_with(r, "MSFT_lod").empty());
}

TEST(Levels, AnotherOneIsBakedOnDemandAndTheCoarsestIfThereAreFewer) {
  BakeSettings settings;
  settings.lod = 1;
  const ImportResult one = imported(with_nodes(kThree, "[0]"), settings);
  EXPECT_EQ(names(one), "other mid ");
  EXPECT_EQ(drawn(one), "high0 low2 ");
  settings.lod = 7;
  const ImportResult last = imported(with_nodes(kThree, "[0]"), settings);
  EXPECT_EQ(names(last), "other low ");
  EXPECT_SAYS(note_with(last, "--lod 7"), "node 1 'high'");
}

TEST(Levels, LevelsBesideTheirNodeAndWithChildren) {
  const ImportResult r = imported(with_nodes(R"([
    {"name": "high", "mesh": 0, "children": [2], "extensions": {"MSFT_lod": {"ids": [1]}}},
    {"name": "low", "children": [3]}, {"name": "handle", "mesh": 1}, {"name": "stub", "mesh": 2}])",
                                             "[0, 1]"));
  EXPECT_EQ(names(r), "high handle ");
  EXPECT_EQ(drawn(r), "stub1 ");
  EXPECT_EQ(r.display.sets[0].sources, (std::vector<uint32_t>{0, 1}));
}

TEST(Levels, AProxyIsBakedForWhatNamesIt) {
  const char* nodes = R"([
    {"name": "a", "mesh": 0, "translation": [1, 0, 0], "extras": {"kiln": {"proxy": "box", "lod_distance": 0.5}}},
    {"name": "b", "mesh": 1, "translation": [2, 0, 0], "extras": {"kiln": {"proxy": 2}}},
    {"name": "box", "mesh": 2}])";
  // Standing nowhere it is placed for each; standing in the scene it is there once, for both.
  const ImportResult free = imported(with_nodes(nodes, "[0, 1]"));
  EXPECT_EQ(names(free), "box box ");
  EXPECT_EQ(drawn(free), "a0 b0 ");
  EXPECT_EQ(free.display.sets[0].sources, std::vector<uint32_t>{0});
  EXPECT_EQ(free.display.sets[1].sources, std::vector<uint32_t>{1});
  EXPECT_EQ(free.display.sets[0].most_distance, 0.5);
  EXPECT_EQ(free.display.sets[0].baked, "proxy node 2 'box'");
  EXPECT_FALSE(free.display.is_drawn(0));
  const ImportResult standing = imported(with_nodes(nodes, "[0, 1, 2]"));
  EXPECT_EQ(names(standing), "box ");
  EXPECT_EQ(drawn(standing), "a0 b0 ");
  EXPECT_EQ(standing.display.sets[0].sources, std::vector<uint32_t>{0});
  EXPECT_EQ(standing.display.sets[1].sources, std::vector<uint32_t>{0});
  // One below the node that it stands for.
  const ImportResult below = imported(with_nodes(R"([
    {"name": "a", "mesh": 0, "children": [1], "extras": {"kiln": {"proxy": "box"}}, "translation": [1, 0, 0]},
    {"name": "box", "mesh": 2, "translation": [0, 2, 0]}])",
                                                 "[0]"));
  EXPECT_EQ(names(below), "box ");
  EXPECT_EQ(drawn(below), "a0 ");
  EXPECT_EQ(below.scene.instances[0].to_world[3], Vec3(1, 2, 0));
  // With levels all of them, 0 too, get its light; one of its own levels is baked in their place.
  const ImportResult both = imported(with_nodes(R"([
    {"name": "a", "mesh": 0, "extras": {"kiln": {"proxy": 2}}, "extensions": {"MSFT_lod": {"ids": [1]}}},
    {"name": "low", "mesh": 1}, {"name": "box", "mesh": 2}])",
                                                "[0]"));
  EXPECT_EQ(names(both) + drawn(both), "box a0 low1 ");
  const ImportResult own = imported(with_nodes(R"([
    {"name": "a", "mesh": 0, "extras": {"kiln": {"proxy": "low"}}, "extensions": {"MSFT_lod": {"ids": [1]}}},
    {"name": "low", "mesh": 1}])",
                                               "[0]"));
  EXPECT_EQ(names(own) + drawn(own), "low a0 ");
  EXPECT_TRUE(own.display.is_drawn(0));
}

TEST(Levels, LampsOfTheNodeStandWhateverIsBaked) {
  auto b = with_nodes(R"([
    {"name": "post", "mesh": 0, "children": [2], "extensions": {"MSFT_lod": {"ids": [1]}}},
    {"name": "low", "mesh": 1, "children": [3]},
    {"extensions": {"KHR_lights_punctual": {"light": 0}}}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}])",
                      "[0]");
  b.root["extensionsUsed"].push_back("KHR_lights_punctual");
  b.root["extensions"]["KHR_lights_punctual"]["lights"].push_back({{"type", "point"}, {"intensity", 10}});
  BakeSettings settings;
  for (settings.lod = 0; settings.lod < 2; ++settings.lod)
    EXPECT_EQ(imported(b, settings).scene.lights.size(), 1u);
}

TEST(Levels, FilesThatMakeNoSenseAreRefusedByName) {
  const auto nodes = [](const char* first, const char* second = R"({"mesh": 1})", const char* roots = "[0]") {
    return refused(
        with_nodes((std::string("[") + first + "," + second + R"(, {"mesh": 2}])").c_str(), roots));
  };
  const auto ids = [&](const char* list) {
    return nodes(
        (std::string(R"({"mesh": 0, "name": "n", "extensions": {"MSFT_lod": {"ids": )") + list + "}}}")
            .c_str());
  };
  EXPECT_SAYS(ids("[7]"), "node 0 'n': MSFT_lod names node 7, there are 3");
  EXPECT_SAYS(ids("[-1]"), "MSFT_lod names node -1");
  EXPECT_SAYS(ids("[1.5]"), "MSFT_lod names node 1.5");
  EXPECT_SAYS(ids("[1e300]"), "MSFT_lod names node");
  EXPECT_SAYS(ids("\"all\""), "node 0 'n': MSFT_lod has no list of ids");
  EXPECT_SAYS(ids("[0]"), "node 0 'n': MSFT_lod names the node itself");
  EXPECT_SAYS(ids("[1, 1]"), "node 1 is a level of node 0 'n' twice");
  const char* back = R"({"mesh": 1, "extensions": {"MSFT_lod": {"ids": [0]}}})";
  EXPECT_SAYS(nodes(R"({"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}})", back),
              "node 1, a level of node 0, has levels or a proxy of its own");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "extensions": {"MSFT_lod": {"ids": [2]}}})",
                    R"({"mesh": 1, "extensions": {"MSFT_lod": {"ids": [2]}}})", "[0, 1]"),
              "node 2 is a level of node 1 twice, or of node 0 too");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "children": [1], "extensions": {"MSFT_lod": {"ids": [1]}}})"),
              "node 1 is a level of node 0 and is placed elsewhere");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "children": [1], "extensions": {"MSFT_lod": {"ids": [2]}}})",
                    R"({"mesh": 1, "extras": {"kiln": {"proxy": 0}}})"),
              "node 0, the proxy of node 1, has levels or a proxy of its own");
  const auto proxy = [&](const char* value) {
    return nodes(
        (std::string(R"({"mesh": 0, "name": "n", "extras": {"kiln": {"proxy": )") + value + "}}}").c_str());
  };
  EXPECT_SAYS(proxy("0"), "node 0 'n': it is its own proxy");
  EXPECT_SAYS(proxy("\"nobody\""), "extras.kiln.proxy is 'nobody', and no node is called so");
  EXPECT_SAYS(proxy("\"\""), "which node 1 and node 2 are called: give an index");
  EXPECT_SAYS(proxy("[1]"), "neither the name of a node nor an index below 3");
  EXPECT_SAYS(proxy("3"), "neither the name of a node nor an index below 3");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "extras": {"kiln": {"proxy": 1, "lod_distance": -1}}})"),
              "node 0: extras.kiln.lod_distance is no distance in metres above 0");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "extras": {"kiln": {"proxy": 1}}})", R"({"name": "empty"})", "[0, 2]"),
              "there is no triangle to bake");
  EXPECT_SAYS(nodes(R"({"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}})",
                    R"({"mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}})"),
              "node 1: EXT_mesh_gpu_instancing is not supported below node 0");
}

}  // namespace
}  // namespace kiln
