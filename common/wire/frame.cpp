#include "common/wire/frame.h"

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/wire/limits.h"

namespace kiln {
namespace {

uint32_t payload_checksum(std::span<const std::byte> payload) {
  return static_cast<uint32_t>(xxh3(payload));
}

}  // namespace

Expected<FrameHeader> read_frame_header(std::span<const std::byte, kFrameHeaderBytes> bytes) {
  ByteReader r(bytes);
  const auto magic = r.get<uint16_t>();
  FrameHeader h;
  h.version = r.get<uint8_t>();
  h.reserved = r.get<uint8_t>();
  h.type = static_cast<MessageType>(r.get<uint16_t>());
  h.flags = r.get<uint16_t>();
  h.length = r.get<uint32_t>();
  h.checksum = r.get<uint32_t>();
  if (magic != kFrameMagic)
    return fail(ErrorKind::kProtocol, "the peer does not speak Kiln's protocol: is the port right?");
  const uint32_t cap = payload_cap(h.type);
  if (!cap) return fail(ErrorKind::kProtocol, text("unknown message type {}", static_cast<uint16_t>(h.type)));
  if (h.length > cap)
    return fail(ErrorKind::kProtocol, text("a message of type {} announces {} bytes, more than the cap of {}",
                                           static_cast<uint16_t>(h.type), h.length, cap));
  return h;
}

Status check_frame_payload(const FrameHeader& header, std::span<const std::byte> payload) {
  if (payload.size() != header.length || payload_checksum(payload) != header.checksum)
    return fail(ErrorKind::kProtocol, "a message was damaged in transit: its checksum differs");
  return {};
}

void seal_frame(MessageType type, Bytes& frame) {
  KILN_CHECK(frame.size() >= kFrameHeaderBytes);
  const auto payload = std::span<const std::byte>(frame).subspan(kFrameHeaderBytes);
  KILN_CHECK(payload.size() <= payload_cap(type));
  ByteWriter w;
  w.put(kFrameMagic);
  w.put(kWireVersion);
  w.put(uint8_t{0});
  w.put(static_cast<uint16_t>(type));
  w.put(uint16_t{0});
  w.put(static_cast<uint32_t>(payload.size()));
  w.put(payload_checksum(payload));
  const Bytes head = w.take();
  KILN_CHECK(head.size() == kFrameHeaderBytes);
  std::memcpy(frame.data(), head.data(), head.size());
}

}  // namespace kiln
