#include "common/base/kept_memory.h"

#include <cstdlib>  // defines __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kiln {

KeptMemory::KeptMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 256 << 20);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

KeptMemory::~KeptMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace kiln
