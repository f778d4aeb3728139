#include "common/wire/frame.h"

#include <random>

#include "common/wire/messages.h"

namespace kiln {
namespace {

Bytes frame_of(MessageType type, size_t payload) {
  Bytes frame(kFrameHeaderBytes + payload, std::byte{42});
  seal_frame(type, frame);
  return frame;
}

Expected<FrameHeader> head_of(const Bytes& frame) {
  return read_frame_header(std::span<const std::byte>(frame).first<kFrameHeaderBytes>());
}

TEST(Frame, LayoutIsTheDocumentedOne) {
  const Bytes f = frame_of(Heartbeat::kKind.type, 5);
  const uint8_t expected[] = {0x4b, 0x4c, kWireVersion, 0, 11, 0, 0, 0, 5, 0, 0, 0};
  EXPECT_EQ(std::memcmp(f.data(), expected, sizeof expected), 0);
}

TEST(Frame, RoundTrip) {
  const Bytes f = frame_of(Result::kKind.type, 100000);
  const auto head = head_of(f);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->type, Result::kKind.type);
  EXPECT_EQ(head->length, 100000u);
  EXPECT_TRUE(check_frame_payload(*head, std::span(f).subspan(kFrameHeaderBytes)));
}

TEST(Frame, LengthsAboveTheCapAreRefusedBeforeAllocation) {
  for (const auto& [type, cap] :
       {std::pair(Hello::kKind.type, kMaxControlBytes), std::pair(Goodbye::kKind.type, kMaxControlBytes),
        std::pair(ChunkPiece::kKind.type, kMaxDataBytes), std::pair(Result::kKind.type, kMaxDataBytes)})
    for (const uint32_t length : {cap, cap + 1, 0xffffffffu}) {
      Bytes f = frame_of(type, 0);
      std::memcpy(f.data() + 8, &length, 4);
      EXPECT_EQ(bool(head_of(f)), length <= cap) << length;
    }
}

TEST(Frame, WrongMagicAndUnknownTypesAreRefused) {
  Bytes f = frame_of(Hello::kKind.type, 0);
  f[0] = std::byte{'G'};
  EXPECT_FALSE(head_of(f));
  for (const int type : {0, static_cast<int>(ClientWelcome::kKind.type) + 1, 255,
                         static_cast<int>(Reply::kKind.type) + 1, 65535}) {
    f = frame_of(Hello::kKind.type, 0);
    const auto value = static_cast<uint16_t>(type);
    std::memcpy(f.data() + 4, &value, 2);
    EXPECT_FALSE(head_of(f)) << type;
  }
}

TEST(Frame, EveryFlippedBitOfAPayloadIsFound) {
  const Bytes f = frame_of(Unit::kKind.type, 64);
  const auto head = head_of(f);
  for (size_t bit = 0; bit < 64 * 8; ++bit) {
    Bytes damaged(f.begin() + kFrameHeaderBytes, f.end());
    damaged[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_FALSE(check_frame_payload(*head, damaged));
  }
}

}  // namespace
}  // namespace kiln
