// A recorded conversation: every frame that a worker received and sent, with times, for reports of bugs.
//
// File: u64 magic, then records: u32 length, u32 low half of the XXH3-64 of the body, body (the fields of
// RecordedEvent). Tokens are left out; scenes and results are in it. A worker that was killed leaves a record
// that ends early, which is the recording's end; any other damage is an error.
#pragma once

#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace kiln {

enum class Recorded : uint8_t { kOpened, kReceived, kSent, kClosed };
template <>
struct EnumField<Recorded> {
  static constexpr const char* kName = "kind of event";
  static constexpr uint8_t kCount = 4;
};

struct RecordedEvent {
  Recorded kind = Recorded::kOpened;
  uint64_t at_ms = 0;  // since the recording began
  Bytes content;       // kReceived, kSent: a frame; kClosed: why, as text
  static void fields(auto& e, auto& v) {
    v(e.kind, e.at_ms, at_most(e.content, kFrameHeaderBytes + kMaxDataBytes));
  }
};

constexpr uint64_t kMaxRecordingBytes = uint64_t{1} << 30;  // then recording stops, and the worker goes on

// The file's first bytes, and one record.
Bytes write_recording_head();
Bytes write_record(const RecordedEvent& event);

struct Recording {
  std::vector<RecordedEvent> events;
  bool cut = false;  // it ends in the middle of a record
};
// Fails (kInvalidInput, with the place) on anything but whole records that hold whole frames of this version.
Expected<Recording> read_recording(std::span<const std::byte> bytes);

// The message of a kReceived or kSent event.
Expected<Message> message_of(const RecordedEvent& event);

}  // namespace kiln
