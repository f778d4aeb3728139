// extras.kiln.receive, .cast and .reflect: who says it, who wins, what is refused, and what workers are sent.
#include "common/scene/prepared.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::says;

json said(json element, json what) {
  element["extras"]["kiln"] = std::move(what);
  return element;
}

// Two meshes of one triangle with a material each, standing nowhere yet.
GltfBuilder two_triangles() {
  GltfBuilder b;
  for (const char* name : {"first", "second"}) {
    const int material = b.material({{"name", name}});
    const int mesh = b.triangle();
    b.root["meshes"][static_cast<size_t>(mesh)]["primitives"][0]["material"] = material;
  }
  return b;
}

TEST(Parts, EverythingTakesPartWhereNothingIsSaid) {
  GltfBuilder b = two_triangles();
  b.node({{"name", "a"}, {"mesh", 0}});
  const ImportResult r = imported(b);
  EXPECT_TRUE(r.scene.instances[0].receive && r.scene.instances[0].cast && r.scene.instances[0].reflect);
  EXPECT_EQ(test::note_with(r, "extras.kiln"), "");
}

TEST(Parts, TheMostSpecificWins) {
  GltfBuilder b = two_triangles();
  b.root["nodes"] = {
      said({{"name", "parent"}, {"children", {1, 2, 3}}}, {{"cast", false}, {"receive", false}}),
      {{"name", "heir"}, {"mesh", 0}},
      said({{"name", "other"}, {"mesh", 0}}, {{"cast", true}}),
      {{"name", "by material"}, {"mesh", 1}},
      said({{"name", "by mesh"}, {"mesh", 1}}, {{"reflect", true}})};
  b.root["scenes"][0]["nodes"] = {0, 4};
  b.root["meshes"][1] = said(b.root["meshes"][1], {{"reflect", false}, {"cast", false}});
  b.root["materials"][1] = said(b.root["materials"][1], {{"cast", true}});
  const ImportResult r = imported(b);
  const auto parts = [&](size_t i) {
    const Instance& in = r.scene.instances[i];
    return std::array<bool, 3>{in.receive, in.cast, in.reflect};
  };
  ASSERT_EQ(r.scene.instances.size(), 4u);
  EXPECT_EQ(parts(0), (std::array{false, false, true})) << "from the parent";
  EXPECT_EQ(parts(1), (std::array{false, true, true})) << "its own word before the parent's";
  EXPECT_EQ(parts(2), (std::array{false, true, false})) << "material before mesh, mesh before node";
  EXPECT_EQ(parts(3), (std::array{true, true, false})) << "the mesh before the node";
  EXPECT_TRUE(says(test::note_with(r, "get no texels"), "3 objects: 'heir', 'other', 'by material'"));
  EXPECT_TRUE(says(test::note_with(r, "block no light"), "1 object: 'heir'"));
  EXPECT_TRUE(says(test::note_with(r, "black to light"), "2 objects: 'by material', 'by mesh'"));
}

TEST(Parts, OtherValuesThanBooleansAreRefusedByName) {
  for (const char* key : {"receive", "cast", "reflect"}) {
    GltfBuilder b = two_triangles();
    b.node(said({{"name", "lid"}, {"mesh", 0}}, {{key, 0}}));
    EXPECT_TRUE(says(test::refused(b), std::string("node 0 'lid': extras.kiln.") + key + " is 0;"));
  }
  GltfBuilder b = two_triangles();
  b.node({{"mesh", 1}});
  b.root["materials"][1] = said(b.root["materials"][1], {{"cast", "no"}});
  EXPECT_TRUE(
      says(test::refused(b), "material 1 'second': extras.kiln.cast is 'no'; it may be true or false"));
}

TEST(Parts, UnknownKeysAreWarnedOf) {
  GltfBuilder b = two_triangles();
  b.node(said({{"name", "lid"}, {"mesh", 0}}, {{"casts", false}, {"density", 2}}));
  const ImportResult r = imported(b);
  EXPECT_TRUE(says(test::note_with(r, "does not know"), "1 element: node 0 'lid' ('casts')"));
  EXPECT_TRUE(r.scene.instances[0].cast);
}

Scene sent(const Scene& scene, Digest& id) {
  ChunkStore chunks;
  id = write_scene(scene, chunks);
  return *read_scene(*chunks.find(id), [&](const Digest& d) { return chunks.find(d); });
}

TEST(Parts, WorkersAreSentWhatConcernsThem) {
  GltfBuilder b = two_triangles();
  b.root["materials"][0]["emissiveFactor"] = {1, 1, 1};
  b.root["materials"][0]["doubleSided"] = true;
  b.node({{"name", "a"}, {"mesh", 0}});
  b.node({{"name", "b"}, {"mesh", 0}});
  Scene scene = imported(b).scene;
  Digest plain, other;
  EXPECT_EQ(sent(scene, plain).materials.size(), 1u);
  scene.instances[0].receive = false;  // the atlas says it
  sent(scene, other);
  EXPECT_EQ(plain, other);
  scene.instances[0].cast = false;
  const Scene without = sent(scene, other);
  EXPECT_NE(plain, other);
  EXPECT_FALSE(without.instances[0].cast);
  EXPECT_TRUE(without.instances[1].cast);
  scene.instances[1].reflect = false;
  const Scene black = sent(scene, other);
  ASSERT_EQ(black.materials.size(), 2u);
  EXPECT_EQ(black.instances[0].material, 0u);
  EXPECT_EQ(black.instances[1].material, 1u);
  EXPECT_EQ(black.materials[1].type, "unlit");
  EXPECT_EQ(black.materials[1].find("base_color")->numbers, (std::vector<double>{0, 0, 0, 1}));
  EXPECT_EQ(black.materials[1].find("double_sided")->numbers[0], 1);
  EXPECT_FALSE(black.materials[1].find("emission"));
}

TEST(Parts, ADamagedListOfWhoCastsIsRefused) {
  GltfBuilder b = two_triangles();
  b.node({{"mesh", 0}});
  Scene scene = imported(b).scene;
  scene.instances[0].cast = false;
  ChunkStore chunks;
  const Bytes whole = *chunks.find(write_scene(scene, chunks));
  const auto find = [&](const Digest& d) { return chunks.find(d); };
  ASSERT_TRUE(read_scene(whole, find));
  Bytes shorter = whole;
  shorter.pop_back();
  EXPECT_FALSE(read_scene(shorter, find));
  Bytes longer = whole;
  longer.push_back(std::byte{1});
  EXPECT_FALSE(read_scene(longer, find));
}

}  // namespace
}  // namespace kiln
