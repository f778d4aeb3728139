#include "common/base/kept_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <optional>
#include <vector>

namespace kiln {
namespace {

long faults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

long resident_pages() {
  long all = 0, resident = 0;
  std::FILE* f = std::fopen("/proc/self/statm", "r");
  if (!f || std::fscanf(f, "%ld %ld", &all, &resident) != 2) resident = -1;
  if (f) std::fclose(f);
  return resident;
}

// The pages of a block are zeroed once, and go back in the end.
TEST(KeptMemory, BlocksAreUsedAgain) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another allocator";
#endif
  constexpr size_t kBytes = size_t{100} << 20;
  const long pages = static_cast<long>(kBytes) / sysconf(_SC_PAGESIZE);
  std::optional<KeptMemory> kept(std::in_place);
  { const std::vector<char> first(kBytes, 1); }
  const long before = faults(), resident = resident_pages();
  ASSERT_GT(resident, pages);
  for (int i = 0; i < 10; ++i) {
    const std::vector<char> again(kBytes, static_cast<char>(i));
    ASSERT_EQ(again[kBytes / 2], i);
  }
  EXPECT_LT(faults() - before, pages);
  kept.reset();
  EXPECT_LT(resident_pages(), resident - pages / 2);
}

}  // namespace
}  // namespace kiln
