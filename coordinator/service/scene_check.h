// Prepares a job's scene once in a process of its own, before the coordinator does it: import, layout and
// plan read bytes of strangers and may ask for any memory and time. Import is deterministic, so what has
// passed there is known to fit here; what does not pass ends a child process, with a sentence, and never the
// coordinator.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "common/job/settings.h"

namespace kiln {

struct PrepareLimits {
  uint64_t memory_bytes = uint64_t{4} << 30;  // resident, and of private data
  int64_t ms = 3'600'000;
};

// The verb of the child, which only this file runs, and its exit status when memory ran out.
inline constexpr const char* kCheckVerb = "check-scene";
inline constexpr int kCheckNoMemory = 9;

// `program`: kiln. `folder`: exists; receives the job's settings. `stop`: kills the child at once. Errors:
// the child's own; kInvalidInput when a limit is passed; kInternal when the child dies; kUnavailable when
// stopped.
Status check_scene_apart(const std::string& program, const std::filesystem::path& scene,
                         const BakeSettings& settings, const std::filesystem::path& folder,
                         const PrepareLimits& limits, const std::atomic<bool>& stop);

}  // namespace kiln
