// KTX2 files as an engine's parser reads them: npm's ktx-parse, when it is installed
// (tests/compare/README.md).
#include "common/base/files.h"
#include "tests/container/pictures.h"

namespace kiln {
namespace {

TEST(KtxParse, ReadsWhatWasWritten) {
  const auto folder = test::source_dir() / "tests/compare";
  if (!std::filesystem::exists(folder / "node_modules/ktx-parse"))
    GTEST_SKIP() << "npm's ktx-parse is not installed: npm ci --prefix tests/compare";
  const test::TempDir dir;
  for (const TextureFormatInfo& info : texture_formats())
    for (const int zstd : {0, 3}) {
      const TextureImages t = test::picture(info.format, 20, 12, 3, 0);
      const auto file = write_ktx2(t, zstd, {{"kiln.page", "7"}});
      ASSERT_TRUE(file);
      const auto path = dir.path() / "x.ktx2";
      ASSERT_TRUE(write_file_atomic(path, *file));
      const auto got = test::run_command("node " + (folder / "ktx_parse.mjs").string() + " " + path.string());
      ASSERT_EQ(got.exit_status, 0) << got.output;
      std::string expected = "format " + std::to_string(info.vulkan) +
                             " size 20 12 layers 3 levels 5 scheme " + (zstd ? "2" : "0") + " transfer 1\n";
      for (const auto& level : t.levels) expected += "level " + std::to_string(3 * level[0].size()) + "\n";
      expected += "KTXorientation rd\nKTXwriter Kiln\nkiln.page 7\n";
      EXPECT_EQ(got.output, expected) << info.name;
    }
}

}  // namespace
}  // namespace kiln
