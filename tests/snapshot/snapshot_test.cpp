// A scene from a snapshot is the scene: the same bytes go to the workers.
#include "coordinator/farm/snapshot/snapshot.h"

#include <sys/stat.h>

#include "common/base/files.h"
#include "common/scene/prepared.h"
#include "tests/import/gltf_builder.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

std::string small_sky() {
  return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" +
         std::string("\x80\x80\x80\x81\x90\x80\x80\x82", 8);
}

void put(const fs::path& path, std::string_view text) {
  fs::create_directories(path.parent_path());
  ASSERT_TRUE(write_file_atomic(path, text));
}

// A .gltf with all kinds of files about it; the sky of the options lies elsewhere.
struct Studio {
  TempDir dir;
  fs::path scene;
  BakeSettings settings;
  Studio() {
    GltfBuilder builder = small_scene();
    builder.root["images"] = json::array();
    for (const char* uri :
         {"textures/a%20b.png", "gone.png", "textures/../c.png", "data:image/png;base64,AAAA"})
      builder.root["images"].push_back({{"uri", uri}});
    builder.root["extensions"]["EXT_lights_ies"]["lights"] = json::array({{{"uri", "lamps/spot.ies"}}});
    builder.root["extensionsUsed"].push_back("EXT_lights_ies");
    builder.root["scenes"][0]["extras"]["kiln"]["environment"] = {{"image", "sky.hdr"}};
    const fs::path folder = dir.path() / "project" / "room";
    fs::create_directories(folder);
    scene = write_gltf_file(builder, folder);
    put(folder / "textures" / "a b.png", "texture");
    put(folder / "c.png", "another");
    put(folder / "lamps" / "spot.ies", "lamp");
    put(folder / "sky.hdr", small_sky());
    put(folder / "x.kiln.json", "{}");
    put(folder / "unrelated.txt", "stays");
    put(dir.path() / "skies" / "noon.hdr", small_sky());
    put(dir.path() / "last" / "charts.json", "{}");
    settings.environment = (dir.path() / "skies" / "noon.hdr").string();
    settings.keep_layout = (dir.path() / "last" / "charts.json").string();
  }
};

Digest scene_digest(const fs::path& scene, const BakeSettings& settings) {
  const auto imported = import_scene(scene, settings);
  if (!imported) {
    ADD_FAILURE() << imported.error().message;
    return {};
  }
  ChunkStore chunks;
  return write_scene(imported->scene, chunks);
}

std::unique_ptr<BlobStore> open_blobs(const fs::path& folder) {
  BlobOptions options;
  options.keep_free = options.keep_free_publishing = 0;
  return std::move(*BlobStore::open(folder, options));
}

TEST(Snapshot, ListsEveryFileThatABakeReads) {
  const Studio studio;
  const auto inputs = list_inputs(studio.scene, studio.settings);
  ASSERT_TRUE(inputs) << inputs.error().message;
  std::vector<std::string> paths;
  for (const InputFile& input : *inputs) {
    paths.push_back(input.path);
    EXPECT_TRUE(fs::is_regular_file(input.source)) << input.source;
  }
  EXPECT_EQ(paths, (std::vector<std::string>{"x.gltf", "c.png", "kiln-options/environment/noon.hdr",
                                             "kiln-options/keep-layout/charts.json", "lamps/spot.ies",
                                             "sky.hdr", "textures/a b.png", "x.bin", "x.kiln.json"}));
  BakeSettings plain;
  plain.environment = "1,2,3";
  EXPECT_EQ(list_inputs(studio.scene, plain)->size(), 7u);
}

TEST(Snapshot, ALaidOutSceneImportsToTheSameBytes) {
  const Studio studio;
  auto snapshot = take_snapshot(studio.scene, studio.settings);
  ASSERT_TRUE(snapshot) << snapshot.error().message;
  const auto blobs = open_blobs(studio.dir.path() / "blobs");
  ASSERT_TRUE(put_snapshot(*snapshot, *blobs, 1));
  const Digest original = scene_digest(studio.scene, studio.settings);
  fs::rename(studio.dir.path() / "project", studio.dir.path() / "away");
  fs::rename(studio.dir.path() / "skies", studio.dir.path() / "away2");
  const fs::path folder = studio.dir.path() / "laid" / "out";
  const Status laid = lay_out(snapshot->files, *blobs, folder);
  ASSERT_TRUE(laid) << laid.error().message;
  for (const FileRecord& file : snapshot->files)
    EXPECT_EQ(sha256(*read_file(folder / file.path)), file.digest) << file.path;
  const BakeSettings settings = settings_in(snapshot->settings, folder);
  EXPECT_EQ(settings.keep_layout, (folder / "kiln-options/keep-layout/charts.json").string());
  EXPECT_EQ(scene_digest(folder / snapshot->scene, settings), original);
  // The sky of the options is in it: another one gives another scene.
  BakeSettings without = settings;
  without.environment = "1,1,1";
  EXPECT_NE(scene_digest(folder / snapshot->scene, without), original);
  EXPECT_EQ(settings_in(without, folder).environment, "1,1,1");
}

TEST(Snapshot, TheSameScenesAreKeptOnceAndChangesAreSeen) {
  const Studio studio;
  const auto first = *take_snapshot(studio.scene, studio.settings);
  const auto blobs = open_blobs(studio.dir.path() / "blobs");
  put(studio.scene.parent_path() / "c.png", "changed meanwhile");
  const Status changed = put_snapshot(first, *blobs, 1);
  ASSERT_FALSE(changed);
  EXPECT_NE(changed.error().message.find("c.png"), std::string::npos);
  const auto second = *take_snapshot(studio.scene, studio.settings);
  ASSERT_TRUE(put_snapshot(second, *blobs, 1));
  size_t differ = 0;
  for (size_t i = 0; i < first.files.size(); ++i) differ += first.files[i] == second.files[i] ? 0 : 1;
  EXPECT_EQ(differ, 1u);
  EXPECT_EQ(lay_out(first.files, *blobs, studio.dir.path() / "x").error().kind, ErrorKind::kInvalidInput);
}

// One flipped bit of a vertex is another lightmap: a file is laid out only if it is what was submitted.
TEST(Snapshot, ADamagedBlobIsNotLaidOut) {
  const Studio studio;
  const auto snapshot = *take_snapshot(studio.scene, studio.settings);
  const auto blobs = open_blobs(studio.dir.path() / "blobs");
  ASSERT_TRUE(put_snapshot(snapshot, *blobs, 1));
  const FileRecord& vertices = *std::find_if(snapshot.files.begin(), snapshot.files.end(),
                                             [](const FileRecord& file) { return file.path == "x.bin"; });
  flip_bit(blobs->path(vertices.digest));
  const fs::path folder = studio.dir.path() / "out";
  const Status damaged = lay_out(snapshot.files, *blobs, folder);
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().kind, ErrorKind::kInvalidInput);
  for (const std::string& words : {std::string("x.bin"), vertices.digest.hex(), std::string("submit")})
    EXPECT_NE(damaged.error().message.find(words), std::string::npos) << damaged.error().message;
  EXPECT_FALSE(fs::exists(folder)) << "half of a scene is left";
  // It was set aside, so that whoever has the file is asked for it.
  EXPECT_FALSE(blobs->has(vertices.digest));
  ASSERT_TRUE(put_snapshot(snapshot, *blobs, 2));
  const Status again = lay_out(snapshot.files, *blobs, folder);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(sha256(*read_file(folder / "x.bin")), vertices.digest);
}

TEST(Snapshot, NothingOutsideIsReadOrWritten) {
  Studio studio;
  BakeSettings gone = studio.settings;
  gone.keep_layout = "/nowhere/charts.json";
  EXPECT_NE(list_inputs(studio.scene, gone).error().message.find("--keep-layout"), std::string::npos);
  const auto blobs = open_blobs(studio.dir.path() / "blobs");
  const FileRecord good = *blobs->put_file(studio.scene, 1);
  for (const char* path : {"../x", "/tmp/kiln-x", "a/../../x"}) {
    const fs::path folder = studio.dir.path() / "out";
    EXPECT_EQ(lay_out({{path, good.digest, good.size}}, *blobs, folder).error().kind,
              ErrorKind::kInvalidInput);
    EXPECT_FALSE(fs::exists(folder));
  }
  EXPECT_FALSE(lay_out({good}, *blobs, studio.dir.path()));  // not empty
  for (const char* uri : {"../secret.png", "/etc/passwd", "file:///etc/passwd", "a/../../x.png"}) {
    GltfBuilder builder = small_scene();
    builder.root["images"] = json::array({{{"uri", uri}}});
    const auto inputs = list_inputs(write_gltf_file(builder, studio.dir.path(), "y.gltf"), {});
    ASSERT_FALSE(inputs) << uri;
    EXPECT_EQ(inputs.error().kind, ErrorKind::kInvalidInput);
  }
}

std::string refusal(const Expected<std::vector<InputFile>>& inputs) {
  EXPECT_FALSE(inputs);
  return inputs ? std::string() : inputs.error().message;
}

TEST(Snapshot, LinksOutOfTheFolderAreRefusedUnlessAllowed) {
  Studio studio;
  const fs::path folder = studio.scene.parent_path(), secret = studio.dir.path() / "secret";
  put(secret, "the key");
  fs::remove(folder / "c.png");
  fs::create_symlink("textures/a b.png", folder / "c.png");  // within the folder: as good as a file
  ASSERT_TRUE(list_inputs(studio.scene, {}));
  fs::remove(folder / "c.png");
  fs::create_symlink(secret, folder / "c.png");
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})),
              "c.png is " + secret.string() + ", outside the scene's folder");
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "--allow-outside");
  EXPECT_TRUE(list_inputs(studio.scene, {}, {.allow_outside = true}));
  // A folder on the way counts too, and so does the scene's own job file.
  fs::remove(folder / "c.png");
  put(studio.dir.path() / "elsewhere" / "spot.ies", "lamp");
  fs::remove_all(folder / "lamps");
  fs::create_directory_symlink(studio.dir.path() / "elsewhere", folder / "lamps");
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "lamps/spot.ies is ");
  fs::remove(folder / "lamps");
  fs::remove(folder / "x.kiln.json");
  fs::create_symlink(secret, folder / "x.kiln.json");
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "x.kiln.json is ");
  // The scene itself may be reached by a link: it was named by the user.
  fs::remove(folder / "x.kiln.json");
  fs::create_symlink("x.gltf", folder / "link.gltf");
  EXPECT_TRUE(list_inputs(folder / "link.gltf", {}));
}

TEST(Snapshot, AJobFileThatWasFoundNamesOnlyFilesOfTheScene) {
  const Studio studio;
  BakeSettings found;
  ASSERT_TRUE(set_option(found, "environment", studio.settings.environment, "job file x.kiln.json"));
  const InputRules beside{.own_job_file = true};
  EXPECT_SAYS(refusal(list_inputs(studio.scene, found, beside)),
              "the environment that x.kiln.json names is ");
  EXPECT_TRUE(list_inputs(studio.scene, found, {.allow_outside = true, .own_job_file = true}));
  EXPECT_TRUE(list_inputs(studio.scene, found)) << "--config names it";
  ASSERT_TRUE(set_option(found, "environment", (studio.scene.parent_path() / "sky.hdr").string(),
                         "job file x.kiln.json"));
  EXPECT_TRUE(list_inputs(studio.scene, found, beside)) << "it is the scene's";
  ASSERT_TRUE(set_option(found, "environment", studio.settings.environment, "command line"));
  EXPECT_TRUE(list_inputs(studio.scene, found, beside)) << "the user names it";
}

TEST(Snapshot, PipesAndDevicesAreRefused) {
  const Studio studio;
  const fs::path folder = studio.scene.parent_path();
  fs::remove(folder / "c.png");
  ASSERT_EQ(::mkfifo((folder / "c.png").c_str(), 0600), 0);
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "c.png is no file but a folder, a pipe or a device");
  fs::remove(folder / "c.png");
  fs::remove(folder / "x.kiln.json");
  fs::create_symlink("/dev/zero", folder / "x.kiln.json");
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "x.kiln.json is no file");
  fs::remove(folder / "x.kiln.json");
  fs::remove(folder / "x.bin");
  ASSERT_EQ(::mkfifo((folder / "x.bin").c_str(), 0600), 0);
  EXPECT_SAYS(refusal(list_inputs(studio.scene, {})), "it is a pipe, not a file");
}

}  // namespace
}  // namespace kiln::test
