#include "worker/agent/replay.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_replay(std::span<const std::byte> data) {
  const auto replay = read_replay(text_of(data));
  require_sentence(replay);
  if (replay)
    require(read_replay(write_replay(*replay, {})).has_value(),
            "a replay that was read can be written and read");
}

}  // namespace kiln::fuzz
