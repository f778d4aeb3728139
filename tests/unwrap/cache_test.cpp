#include <fstream>

#include "common/base/files.h"
#include "common/unwrap/unwrap_cache.h"
#include "tests/unwrap/solids.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using namespace test;

struct Folder {
  fs::path path = fs::temp_directory_path() / ("kiln-unwrap-" + random_hex(8));
  ~Folder() { fs::remove_all(path); }
  std::vector<fs::path> files() const {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(path)) all.push_back(entry.path());
    return all;
  }
};

TEST(UnwrapCache, AHitEqualsAMissAndDamageIsRepaired) {
  const Folder folder;
  const Mesh m = torus(24, 2, 0.7f);
  const UnwrapResult fresh = unwrap(m, {}, 1);
  EXPECT_EQ(unwrap_cached(m, {}, folder.path, 1).charts.corner_uv, fresh.charts.corner_uv);
  ASSERT_EQ(folder.files().size(), 1u);
  const fs::path file = folder.files()[0];
  const UnwrapCache cache(folder.path);
  const Digest key = unwrap_key(m, {});
  const auto hit = cache.load(key, m.triangles.size());
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->charts.corner_uv, fresh.charts.corner_uv);
  EXPECT_EQ(hit->charts.chart_of_face, fresh.charts.chart_of_face);
  EXPECT_EQ(hit->charts.chart_count, fresh.charts.chart_count);
  EXPECT_EQ(hit->stretch.l2, fresh.stretch.l2);
  EXPECT_FALSE(cache.load(key, m.triangles.size() + 1));

  const Bytes whole = *read_file(file);
  for (size_t at = 0; at < whole.size(); at += whole.size() / 97) {
    Bytes damaged = whole;
    damaged[at] ^= std::byte{4};
    ASSERT_TRUE(write_file_atomic(file, damaged));
    EXPECT_FALSE(cache.load(key, m.triangles.size())) << at;
    damaged = whole;
    damaged.resize(at);
    ASSERT_TRUE(write_file_atomic(file, damaged));
    EXPECT_FALSE(cache.load(key, m.triangles.size())) << at;
  }
  EXPECT_EQ(unwrap_cached(m, {}, folder.path, 1).charts.corner_uv, fresh.charts.corner_uv);
  EXPECT_EQ(*read_file(file), whole);
}

TEST(UnwrapCache, EverythingThatMattersIsInTheKey) {
  const Mesh m = box({1, 2, 3}, Uv::kNone);
  const Digest key = unwrap_key(m, {});
  EXPECT_EQ(unwrap_key(m, {}), key);
  Mesh moved = m;
  moved.positions[3].x += 1e-6f;
  EXPECT_NE(unwrap_key(moved, {}), key);
  Mesh shaded = m;
  shaded.normals[0] = Vec3(0, 0, 1);
  EXPECT_NE(unwrap_key(shaded, {}), key);
  UnwrapSettings settings;
  settings.limits.l2 = 1.2;
  EXPECT_NE(unwrap_key(m, settings), key);
}

TEST(UnwrapCache, TheOldestGoAndAFolderThatCannotBeIsNone) {
  const Folder folder;
  const Mesh m = sphere(6, 1);
  const UnwrapResult made = unwrap(m, {}, 1);
  UnwrapCache(folder.path).store(unwrap_key(m, {}), made);
  const uint64_t bytes = fs::file_size(folder.files()[0]);
  fs::last_write_time(folder.files()[0], fs::file_time_type::clock::now() - std::chrono::hours(20));
  const UnwrapCache two(folder.path, 2 * bytes + bytes / 2);
  UnwrapSettings settings;
  for (uint32_t i = 0; i < 4; ++i) {
    settings.max_charts = 1000 + i;
    const Digest key = unwrap_key(m, settings);
    two.store(key, made);
    const fs::path file = folder.path / (key.hex() + ".unwrap");
    if (fs::exists(file))
      fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(9 - i));
  }
  EXPECT_EQ(folder.files().size(), 2u);
  EXPECT_TRUE(two.load(unwrap_key(m, settings), m.triangles.size()));
  EXPECT_FALSE(two.load(unwrap_key(m, {}), m.triangles.size()));

  const UnwrapCache nowhere("/dev/null/kiln");
  nowhere.store(unwrap_key(m, {}), made);
  EXPECT_FALSE(nowhere.load(unwrap_key(m, {}), m.triangles.size()));
}

}  // namespace
}  // namespace kiln
