// Keeps large blocks that are freed for those that are allocated next.
#pragma once

namespace kiln {

// A bake of a large map allocates gigabytes in blocks of megabytes again and again, and glibc gives each back
// to the system when it is freed: the next one is zeroed anew, page by page. While one of these lives, blocks
// of up to 256 MB are kept, a gigabyte in all at the end of the heap; what is free goes back when it dies.
// Concerns all of the process; does nothing without glibc.
class KeptMemory {
 public:
  KeptMemory();
  ~KeptMemory();
  KeptMemory(const KeptMemory&) = delete;
  KeptMemory& operator=(const KeptMemory&) = delete;
};

}  // namespace kiln
