#include "common/wire/messages.h"

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

// Calls f.operator()<M>() for every alternative of Message.
template <class F>
void for_each_message(F&& f) {
  [&]<size_t... I>(std::index_sequence<I...>) {
    (f.template operator()<std::variant_alternative_t<I, Message>>(), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Message>>());
}

constexpr bool numbers_differ() {
  return []<size_t... I>(std::index_sequence<I...>) {
    const MessageType all[] = {std::variant_alternative_t<I, Message>::kKind.type...};
    for (size_t a = 0; a < std::size(all); ++a)
      for (size_t b = 0; b < a; ++b)
        if (all[a] == all[b]) return false;
    return true;
  }
  (std::make_index_sequence<std::variant_size_v<Message>>());
}
static_assert(numbers_differ(), "two messages have one number");

}  // namespace

std::string_view message_name(MessageType type) {
  std::string_view name;
  for_each_message([&]<class M>() {
    if (M::kKind.type == type) name = M::kKind.name;
  });
  return name;
}

uint32_t payload_cap(MessageType type) {
  if (message_name(type).empty()) return 0;
  return static_cast<uint16_t>(type) < kFirstDataType ? kMaxControlBytes : kMaxDataBytes;
}

Bytes encode(const Message& message) {
  return std::visit(
      []<class M>(const M& m) {
        Bytes frame = write_fields(m, kFrameHeaderBytes);
        seal_frame(M::kKind.type, frame);
        return frame;
      },
      message);
}

Expected<Message> decode(const FrameHeader& header, std::span<const std::byte> payload) {
  if (header.type != Refused::kKind.type) {
    if (header.version != kWireVersion)
      return fail(ErrorKind::kProtocol,
                  text("the peer speaks version {} of the protocol and this program {}: "
                       "install the same release on both machines",
                       header.version, kWireVersion));
    if (header.reserved != 0 || header.flags != 0)
      return fail(ErrorKind::kProtocol, "the head of a message is damaged: bytes that are zero are not");
  }
  Expected<Message> message = fail(ErrorKind::kProtocol, "unknown message type");
  for_each_message([&]<class M>() {
    if (M::kKind.type != header.type) return;
    auto read = read_fields<M>(payload, ErrorKind::kProtocol, text("{} message", M::kKind.name));
    if (read)
      message = std::move(*read);
    else
      message = fail(read.error().kind, read.error().message);
  });
  return message;
}

}  // namespace kiln
