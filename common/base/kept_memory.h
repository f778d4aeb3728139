// Keeps large blocks that are freed for those that are allocated next.
#pragma once

namespace kiln {

// A bake of a large map allocates gigabytes in blocks of megabytes again and again, and glibc gives each back
// to the system when it is freed: the next one is zeroed anew, page by page. While one of these lives, blocks
// of up to 256 MB are kept, and up to a gigabyte of free memory at the end of the heap; what is free goes
// back when it dies. Concerns the whole process: of several at a time the first that dies ends it for all,
// which costs time and nothing else. Does nothing without glibc.
class KeptMemory {
 public:
  KeptMemory();
  ~KeptMemory();
  KeptMemory(const KeptMemory&) = delete;
  KeptMemory& operator=(const KeptMemory&) = delete;
};

}  // namespace kiln
