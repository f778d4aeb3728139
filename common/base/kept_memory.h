// Keeps large blocks that are freed for those that are allocated next.
#pragma once

namespace kiln {

// A bake of a large map allocates gigabytes in blocks of megabytes again and again, and glibc gives each back
// to the system when it is freed: the next one is zeroed anew, page by page. While one of these lives, blocks
// of up to `block` bytes are kept, and up to `all` bytes of free memory at the end of each heap; what is free
// goes back when it dies. Concerns the whole process: of several at a time the first that dies ends it for
// all, which costs time and nothing else. Does nothing without glibc.
class KeptMemory {
 public:
  // A coordinator's: arrays of a value for each texel.
  KeptMemory() : KeptMemory(256 << 20, 1 << 30) {}
  KeptMemory(int block, int all);
  ~KeptMemory();
  KeptMemory(const KeptMemory&) = delete;
  KeptMemory& operator=(const KeptMemory&) = delete;
};

}  // namespace kiln
