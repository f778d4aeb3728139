// Messages of every type, made from their descriptions.
#pragma once

#include "common/wire/messages.h"
#include "tests/wire/field_samples.h"

namespace kiln::test {

constexpr uint64_t kSamplesOfAType = 3;

// kSamplesOfAType of each type, in the order of Message.
inline std::vector<Message> sample_messages(uint64_t seed = 1) {
  std::vector<Message> messages;
  [&]<size_t... I>(std::index_sequence<I...>) {
    const auto add = [&]<class M>(M*) {
      for (uint64_t n = 0; n < kSamplesOfAType; ++n) messages.push_back(sample<M>(seed + n));
    };
    (add(static_cast<std::variant_alternative_t<I, Message>*>(nullptr)), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Message>>());
  return messages;
}

inline Expected<Message> decode_frame(std::span<const std::byte> frame) {
  KILN_TRY(const FrameHeader header, read_frame_header(frame.first<kFrameHeaderBytes>()));
  const auto payload = frame.subspan(kFrameHeaderBytes);
  KILN_TRY_STATUS(check_frame_payload(header, payload));
  return decode(header, payload);
}

}  // namespace kiln::test
