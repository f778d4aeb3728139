// What is left of an earlier bake in the output folder, and what a hostile report.json can make of that:
// nothing.
#include "coordinator/run/publish_folder.h"

#include <fstream>
#include <map>

#include "common/base/files.h"
#include "coordinator/run/encode_run.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

using Names = std::set<std::string>;

class Publish : public testing::Test {
 protected:
  void put(const fs::path& name, const std::string& text = "x") const {
    fs::create_directories((out() / name).parent_path());
    std::ofstream(out() / name) << text;
  }
  bool has(const fs::path& name) const { return fs::exists(fs::symlink_status(out() / name)); }
  std::string text_of(const fs::path& name) const {
    std::ifstream in(out() / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path out() const { return dir_.path() / "out"; }
  Publish() { fs::create_directories(out()); }

  test::TempDir dir_;
};

TEST_F(Publish, ReplacesWhatTheReportLists) {
  put("report.json", R"({"files": ["a.exr", "b.dds"], "outputs": [{"file": "old.glb"}]})");
  for (const char* name : {"a.exr", "b.dds", "old.glb", "notes.txt", "lightmap_mine.png"}) put(name, "old");
  auto folder = PublishFolder::open(out());
  ASSERT_TRUE(folder) << folder.error().message;
  std::ofstream(folder->path() / "a.exr") << "new";
  std::ofstream(folder->path() / "report.json") << R"({"files": ["a.exr"]})";
  EXPECT_EQ(*folder->names(), (Names{"a.exr", "report.json"}));
  EXPECT_EQ(text_of("a.exr"), "old") << "nothing changes before publish()";
  ASSERT_TRUE(folder->publish("report.json"));
  EXPECT_EQ(text_of("a.exr"), "new");
  EXPECT_FALSE(has("b.dds"));
  EXPECT_FALSE(has("old.glb"));
  EXPECT_TRUE(has("notes.txt") && has("lightmap_mine.png")) << "nobody listed them";
  EXPECT_EQ(text_of("report.json"), R"({"files": ["a.exr"]})");
}

TEST_F(Publish, NothingIsLeftOfWhatWasNotPublished) {
  put("report.json", R"({"files": ["a.exr"]})");
  put("a.exr", "old");
  {
    auto folder = PublishFolder::open(out());
    ASSERT_TRUE(folder);
    std::ofstream(folder->path() / "a.exr") << "new";
  }
  EXPECT_EQ(text_of("a.exr"), "old");
  EXPECT_TRUE(has("report.json"));
  EXPECT_EQ(std::distance(fs::directory_iterator(out()), fs::directory_iterator()), 2);
}

TEST_F(Publish, TakesOnlyNamesOfFilesInTheFolder) {
  const std::string hostile =
      R"({"files": ["../outside.txt", "..", ".", "", ".hidden", "sub/file", "/etc/hostname",
      "a\\b", "a\u0000b", "report.json", "encode.json", 7, null, ["x"], {"file": "y"}, "good.exr"],
      "outputs": [{"file": "../outside.txt"}, {"file": 3}, "text", null, {"name": "z"}], "added_before": "no list"})";
  EXPECT_EQ(listed_files(hostile), Names{"good.exr"});
  for (const char* broken :
       {"", "{", "[]", "7", "null", R"({"files": {}, "outputs": 3})", "{\"files\": [\"a\""})
    EXPECT_TRUE(listed_files(broken).empty()) << broken;
  EXPECT_TRUE(listed_files(R"({"files": [")" + std::string(300, 'a') + "\"]}").empty());
  EXPECT_TRUE(listed_files(std::string(100000, '[')).empty());
}

TEST_F(Publish, FollowsNoLinkAndRemovesNoFolder) {
  std::ofstream(dir_.path() / "outside.txt") << "mine";
  put("folder/inside.txt");
  fs::create_symlink(dir_.path() / "outside.txt", out() / "link.exr");
  fs::create_directory_symlink(dir_.path(), out() / "way");
  put("report.json",
      R"({"files": ["../outside.txt", "link.exr", "folder", "folder/inside.txt", "way", "way/outside.txt", "a.exr"]})");
  put("a.exr");
  const auto removed = remove_earlier_bake(out(), {});
  ASSERT_TRUE(removed);
  EXPECT_EQ(*removed, 2u) << "a.exr and the report";
  EXPECT_TRUE(fs::exists(dir_.path() / "outside.txt"));
  EXPECT_TRUE(has("link.exr") && has("way") && has("folder/inside.txt"));
  EXPECT_FALSE(has("a.exr") || has("report.json"));
}

TEST_F(Publish, WithoutAReportNothingGoes) {
  put("a.exr");
  EXPECT_EQ(*remove_earlier_bake(out(), {}), 0u);
  for (const char* broken : {"{\"files\": [\"a.exr\"]", "[\"a.exr\"]", ""}) {
    put("report.json", broken);
    EXPECT_EQ(*remove_earlier_bake(out(), {}), 0u) << broken;
    EXPECT_TRUE(has("a.exr") && has("report.json")) << broken;
  }
  fs::remove(out() / "report.json");
  std::ofstream(dir_.path() / "other.json") << R"({"files": ["a.exr"]})";
  fs::create_symlink(dir_.path() / "other.json", out() / "report.json");
  EXPECT_EQ(*remove_earlier_bake(out(), {}), 0u) << "a report behind a link is not this folder's";
  EXPECT_TRUE(has("a.exr"));
}

// The report goes last: while it is there, it lists what is still to go.
TEST_F(Publish, AReportThatCannotFinishStays) {
  put("report.json", R"({"files": ["a.exr", "z.exr"]})");
  put("a.exr");
  EXPECT_EQ(*remove_earlier_bake(out(), {"z.exr"}), 2u);
  put("report.json", R"({"files": ["z.exr"]})");
  put("encode.json", R"({"files": ["e.dds"], "added_before": ["f.dds"]})");
  for (const char* name : {"z.exr", "e.dds", "f.dds"}) put(name);
  EXPECT_EQ(*remove_earlier_bake(out(), {"e.dds"}), 4u);
  EXPECT_TRUE(has("e.dds"));
  EXPECT_FALSE(has("z.exr") || has("f.dds") || has("report.json") || has("encode.json"));
}

// A process killed between the removal of the earlier report and the new one.
TEST_F(Publish, ClearsAfterAnInterruptedOne) {
  put("a.exr", "half of the new bake");
  put("mine.txt");
  put(".kiln-publishing/report.json", R"({"files": ["a.exr", "b.exr"]})");
  put(".kiln-publishing/b.exr");
  {
    auto folder = PublishFolder::open(out());
    ASSERT_TRUE(folder);
    EXPECT_TRUE(folder->names()->empty());
    EXPECT_FALSE(has("a.exr"));
    EXPECT_TRUE(has("mine.txt"));
  }
  // Killed before that, the earlier bake is whole.
  put("a.exr", "old");
  put("report.json", R"({"files": ["a.exr"]})");
  put(".kiln-publishing/report.json", R"({"files": ["a.exr"]})");
  auto folder = PublishFolder::open(out());
  ASSERT_TRUE(folder);
  EXPECT_EQ(text_of("a.exr"), "old");
}

TEST_F(Publish, TheHiddenFolderMayBeALinkThatIsNotFollowed) {
  fs::create_directories(dir_.path() / "precious");
  std::ofstream(dir_.path() / "precious/report.json") << R"({"files": ["a.exr"]})";
  put("a.exr");
  fs::create_directory_symlink(dir_.path() / "precious", out() / ".kiln-publishing");
  auto folder = PublishFolder::open(out());
  ASSERT_TRUE(folder) << folder.error().message;
  EXPECT_TRUE(fs::exists(dir_.path() / "precious/report.json"));
  EXPECT_FALSE(fs::is_symlink(folder->path()));
  EXPECT_TRUE(has("a.exr"));
}

TEST_F(Publish, OneAtATime) {
  auto first = PublishFolder::open(out());
  ASSERT_TRUE(first);
  const auto second = PublishFolder::open(out());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another bake is publishing"), std::string::npos);
  EXPECT_TRUE(fs::exists(first->path())) << "the first one's files are left alone";
}

class ReusedFolder : public Publish {
 protected:
  ReusedFolder() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }
  Expected<BakeReport> bake(const std::map<std::string, std::string>& options) {
    BakeRequest r;
    r.scene = dir_.path() / "room.glb";
    r.output = out();
    r.worker_program = test::binary_dir() / "bin/kiln-worker";
    r.settings.unwrap_cache = "off";
    for (const auto& [name, value] :
         std::map<std::string, std::string>{{"layout", "pack"}, {"min-samples", "4"}, {"max-samples", "4"}})
      EXPECT_TRUE(set_option(r.settings, name, value, "test"));
    for (const auto& [name, value] : options) EXPECT_TRUE(set_option(r.settings, name, value, "test"));
    return run_bake(r, [](const BakeProgress&) {});
  }
  Names names() const {
    Names all;
    for (const auto& entry : fs::directory_iterator(out())) all.insert(entry.path().filename().string());
    return all;
  }
};

TEST_F(ReusedFolder, HoldsTheFilesOfTheLastBakeAlone) {
  put("notes.txt");
  const auto first = bake({{"texels-per-metre", "2"}});
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_TRUE(has("lightmap_bc6h_L0.dds") && has("lightmap_bc7_L1x.ktx2") && has("scene_unlit.glb"));
  Names expected = first->files;
  expected.insert({"report.json", "notes.txt"});
  EXPECT_EQ(names(), expected);
  const auto again = run_encode({dir_.path() / "room.glb", out(), out(),
                                 [] {
                                   BakeSettings s;
                                   EXPECT_TRUE(set_option(s, "encode", "half", "test"));
                                   return s;
                                 }()},
                                [](const BakeProgress&) {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_TRUE(has("lightmap_half_L0.dds") && has("lightmap_bc6h_L0.dds") && has("report.json"))
      << "textures are added to the bake's folder";
  const auto second = bake({{"texels-per-metre", "1"},
                            {"encode", "none"},
                            {"preview", "off"},
                            {"embed-basecolor", "off"},
                            {"basis", "irradiance"}});
  ASSERT_TRUE(second) << second.error().message;
  expected = second->files;
  expected.insert({"report.json", "notes.txt"});
  EXPECT_EQ(names(), expected);
  for (const char* gone : {"lightmap_bc6h_L0.dds", "lightmap_half_L0.dds", "encode.json", "sh_l1.exr",
                           "preview.png", "validity.png", "scene_unlit.glb"})
    EXPECT_FALSE(has(gone)) << gone;
}

TEST_F(ReusedFolder, ABakeThatFailsLeavesTheEarlierOne) {
  ASSERT_TRUE(bake({{"texels-per-metre", "2"}}));
  const Names before = names();
  const std::string report = text_of("report.json");
  EXPECT_FALSE(bake({{"texels-per-metre", "1"}, {"camera", "no such camera"}}));
  EXPECT_EQ(names(), before);
  EXPECT_EQ(text_of("report.json"), report);
}

}  // namespace
}  // namespace kiln
