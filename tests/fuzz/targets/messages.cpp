// The decoders behind the checksum: two bytes of type, then the payload.
#include "common/wire/messages.h"

#include "common/wire/limits.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {
namespace {

Expected<Message> decode_payload(MessageType type, std::span<const std::byte> bytes) {
  const Bytes payload(bytes.begin(), bytes.end());
  return decode({kWireVersion, 0, type, 0, static_cast<uint32_t>(payload.size()), 0}, payload);
}

}  // namespace

void fuzz_messages(std::span<const std::byte> data) {
  uint16_t type = 0;
  if (data.size() < sizeof type) return;
  std::memcpy(&type, data.data(), sizeof type);
  if (payload_cap(MessageType{type}) == 0) return;
  const auto message = decode_payload(MessageType{type}, data.subspan(sizeof type));
  require_sentence(message);
  if (!message) return;
  // What was understood can be said again, and is understood as the same.
  const Bytes frame = encode(*message);
  const auto again = decode_payload(MessageType{type}, std::span(frame).subspan(kFrameHeaderBytes));
  require(again.has_value(), "a message that was decoded can be encoded and decoded");
  require(encode(*again) == frame, "encoding is stable");
}

}  // namespace kiln::fuzz
