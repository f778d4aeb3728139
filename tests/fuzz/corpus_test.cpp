// Every fuzz target once over its corpus, in the ordinary build: seeds, and inputs that crashed once.
#include "common/base/files.h"
#include "common/wire/limits.h"
#include "roster.h"

namespace kiln {
namespace {

class FuzzCorpus : public testing::TestWithParam<fuzz::Target> {};

TEST_P(FuzzCorpus, RunsOver) {
  size_t inputs = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(test::source_dir() / "tests/fuzz/corpus" / GetParam().name)) {
    SCOPED_TRACE(entry.path());
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    GetParam().run(*bytes);
    // A quarter, three quarters, and one bit changed: a target must take more than its seeds.
    GetParam().run(std::span(*bytes).first(bytes->size() / 4));
    GetParam().run(std::span(*bytes).first(bytes->size() / 4 * 3));
    Bytes damaged = *bytes;
    if (!damaged.empty()) damaged[damaged.size() / 2] ^= std::byte{4};
    GetParam().run(damaged);
    ++inputs;
  }
  EXPECT_GT(inputs, 0u) << "a target without a seed: add some to tests/fuzz/seeds.cpp and run fuzz_seeds";
}

// Frames of an earlier wire are refused by their head: a fuzzer that begins with them does not come far.
TEST(FuzzSeeds, OfFramesAreOfThePresentWire) {
  const auto folder = test::source_dir() / "tests/fuzz/corpus/frame";
  size_t seeds = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with("sample-")) continue;
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes && bytes->size() > 2);
    EXPECT_EQ(std::to_integer<uint8_t>((*bytes)[2]), kWireVersion)
        << entry.path() << ": run fuzz_seeds (tests/fuzz/README.md)";
    ++seeds;
  }
  EXPECT_GT(seeds, 10u);
}

INSTANTIATE_TEST_SUITE_P(All, FuzzCorpus, testing::ValuesIn(fuzz::kTargets),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace kiln
