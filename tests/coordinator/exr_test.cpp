#include "coordinator/scene/imageio/exr.h"

#include "common/base/files.h"

namespace kiln {
namespace {

TEST(Exr, RoundTripIsExactIncludingExtremes) {
  test::TempDir dir;
  const std::vector<float> a = {0, 1e-38f, 3.4e38f, -2.5f, 1.0f / 3, 1e9f}, b = {1, 2, 3, 4, 5, 6};
  const ExrChannel channels[] = {{"L0.R", a.data()}, {"L1x.G", b.data()}};
  ASSERT_TRUE(write_exr(dir.path() / "x.exr", 3, 2, channels));
  const auto back = read_exr(dir.path() / "x.exr");
  ASSERT_TRUE(back);
  EXPECT_EQ(back->plane("L0.R"), a);
  EXPECT_EQ(back->plane("L1x.G"), b);
}

TEST(Exr, EqualPlanesGiveEqualFiles) {
  test::TempDir dir;
  const std::vector<float> a(100, 0.25f);
  const ExrChannel channels[] = {{"Y", a.data()}};
  ASSERT_TRUE(write_exr(dir.path() / "a.exr", 10, 10, channels));
  ASSERT_TRUE(write_exr(dir.path() / "b.exr", 10, 10, channels));
  EXPECT_EQ(*read_file(dir.path() / "a.exr"), *read_file(dir.path() / "b.exr"));
}

TEST(Exr, DamageAndSizeAreRefused) {
  test::TempDir dir;
  const std::vector<float> a(100, 0.25f);
  const ExrChannel channels[] = {{"Y", a.data()}};
  ASSERT_TRUE(write_exr(dir.path() / "a.exr", 10, 10, channels));
  EXPECT_FALSE(read_exr(dir.path() / "a.exr", 99));
  Bytes bytes = *read_file(dir.path() / "a.exr");
  bytes.resize(bytes.size() / 2);
  ASSERT_TRUE(write_file_atomic(dir.path() / "half.exr", bytes));
  EXPECT_FALSE(read_exr(dir.path() / "half.exr"));
}

}  // namespace
}  // namespace kiln
