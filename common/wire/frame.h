// The frame around every message: 16 bytes, little-endian, the same in every protocol version.
//   u16 magic  u8 version  u8 reserved  u16 type  u16 flags  u32 length  u32 checksum
// `checksum` is the low half of XXH3-64 of the payload: it detects damage, not tampering.
#pragma once

#include <array>
#include <span>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// A message's number: its `kKind` in messages.h.
enum class MessageType : uint16_t {};
constexpr uint16_t kFirstDataType = 256;

constexpr size_t kFrameHeaderBytes = 16;
constexpr uint16_t kFrameMagic = 0x4c4b;  // "KL"

struct FrameHeader {
  uint8_t version = 0, reserved = 0;  // reserved: 0 in this version
  MessageType type{};
  uint16_t flags = 0;  // 0 in this version
  uint32_t length = 0, checksum = 0;
};

// Fails (kProtocol) on a wrong magic, an unknown type or a length above the type's cap. Any version passes:
// decode() refuses it in words.
Expected<FrameHeader> read_frame_header(std::span<const std::byte, kFrameHeaderBytes> bytes);
Status check_frame_payload(const FrameHeader& header, std::span<const std::byte> payload);

// `frame` starts with kFrameHeaderBytes to be overwritten, then the payload, which is below the type's cap.
void seal_frame(MessageType type, Bytes& frame);

uint32_t payload_cap(MessageType type);  // 0: no such type

}  // namespace kiln
