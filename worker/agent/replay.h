// Everything needed to bake one unit again: the job, the unit and the chunks by name.
#pragma once

#include <string>
#include <unordered_set>

#include "worker/agent/agent.h"

namespace kiln {

struct Replay {
  JobSpec job;
  WorkUnit unit;
};

// Flat JSON. `chunks`: all that the job needs, for copying them to another machine.
std::string write_replay(const Replay& replay, const std::unordered_set<Digest>& chunks);
Expected<Replay> read_replay(std::string_view text);

// Bakes the unit in the file from chunks in the disk cache and prints "digest ...", "rays ..." and "seconds
// ...". Fails with the unit's own error, or (kUnavailable) if a chunk is not in the cache.
Expected<std::string> run_replay(const std::string& file, const AgentSettings& settings);

}  // namespace kiln
