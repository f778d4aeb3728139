// Plays a recording against an agent, without a coordinator: the agent is told what it was told then, in the
// same order, and its answers are compared.
#pragma once

#include <string>

#include "worker/agent/agent.h"

namespace kiln {

struct PlayOutcome {
  bool same = false;  // every recorded answer was given again, with the same digest
  std::string words;  // lines for a person
};

// Fails if the file is no recording. `settings`: threads, memory and the bake; neither cache nor coordinator.
Expected<PlayOutcome> run_play(const std::string& file, AgentSettings settings);

}  // namespace kiln
