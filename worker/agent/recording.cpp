#include "worker/agent/recording.h"

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint64_t kMagic = 0x31564e4f434c494b;                             // "KILCONV1"
constexpr size_t kMaxBody = 1 + 8 + 8 + kFrameHeaderBytes + kMaxDataBytes;  // of a record
constexpr size_t kRecordHead = 8;

uint32_t checksum(std::span<const std::byte> body) {
  return static_cast<uint32_t>(xxh3(body));
}

tl::unexpected<Error> damaged(size_t at, const std::string& why) {
  return fail(ErrorKind::kInvalidInput, text("the recording is damaged at byte {}: {}", at, why));
}

}  // namespace

Bytes write_recording_head() {
  ByteWriter w;
  w.put(kMagic);
  return w.take();
}

Bytes write_record(const RecordedEvent& event) {
  const Bytes body = write_fields(event);
  KILN_CHECK(body.size() <= kMaxBody);
  ByteWriter w;
  w.put(static_cast<uint32_t>(body.size()));
  w.put(checksum(body));
  Bytes record = w.take();
  record.insert(record.end(), body.begin(), body.end());
  return record;
}

Expected<Message> message_of(const RecordedEvent& event) {
  const std::span<const std::byte> frame(event.content);
  if (frame.size() < kFrameHeaderBytes) return fail(ErrorKind::kProtocol, "it holds no frame");
  KILN_TRY(const FrameHeader header, read_frame_header(frame.first<kFrameHeaderBytes>()));
  KILN_TRY_STATUS(check_frame_payload(header, frame.subspan(kFrameHeaderBytes)));
  return decode(header, frame.subspan(kFrameHeaderBytes));
}

Expected<Recording> read_recording(std::span<const std::byte> bytes) {
  ByteReader head(bytes);
  if (head.get<uint64_t>() != kMagic)
    return fail(ErrorKind::kInvalidInput,
                "this is no recording of a worker (kiln-worker --record makes one)");
  Recording recording;
  for (size_t at = sizeof kMagic; at < bytes.size();) {
    ByteReader r(bytes.subspan(at));
    const auto length = r.get<uint32_t>(), sum = r.get<uint32_t>();
    if (length > kMaxBody) return damaged(at, text("a record of {} bytes, of {} at most", length, kMaxBody));
    if (!r.ok() || length > bytes.size() - at - kRecordHead) {
      recording.cut = true;
      return recording;
    }
    const auto body = bytes.subspan(at + kRecordHead, length);
    if (checksum(body) != sum) return damaged(at, "a record's checksum differs");
    auto event = read_fields<RecordedEvent>(body, ErrorKind::kInvalidInput, "record");
    if (!event) return damaged(at, event.error().message);
    if (event->kind == Recorded::kReceived || event->kind == Recorded::kSent)
      if (const auto message = message_of(*event); !message) return damaged(at, message.error().message);
    recording.events.push_back(std::move(*event));
    at += kRecordHead + length;
  }
  return recording;
}

}  // namespace kiln
