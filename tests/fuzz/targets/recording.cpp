#include "worker/agent/recording.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_recording(std::span<const std::byte> data) {
  const auto recording = read_recording(data);
  require_sentence(recording);
  if (!recording) return;
  Bytes again = write_recording_head();
  for (const RecordedEvent& event : recording->events) {
    const Bytes record = write_record(event);
    again.insert(again.end(), record.begin(), record.end());
  }
  require(again.size() <= data.size() && std::equal(again.begin(), again.end(), data.begin()),
          "a recording that was read is written as the same bytes");
}

}  // namespace kiln::fuzz
