#include "common/base/kept_memory.h"

#include <cstdlib>  // defines __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kiln {

namespace {

void keep_up_to([[maybe_unused]] int block, [[maybe_unused]] int all) {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, block);
  mallopt(M_TRIM_THRESHOLD, all);
#endif
}

}  // namespace

KeptMemory::KeptMemory() {
  keep_up_to(256 << 20, 1 << 30);
}

KeptMemory::~KeptMemory() {
  keep_up_to(32 << 20, 64 << 20);  // as far as glibc goes by itself
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace kiln
