// A whole frame as it comes from a socket: header, cap, checksum, decoder.
#include "common/wire/frame.h"

#include "common/wire/messages.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_frame(std::span<const std::byte> data) {
  if (data.size() < kFrameHeaderBytes) return;
  const auto header = read_frame_header(data.first<kFrameHeaderBytes>());
  require_sentence(header);
  if (!header) return;
  require(header->length <= payload_cap(header->type), "a header that passes is below its type's cap");
  const Bytes payload(data.begin() + kFrameHeaderBytes, data.end());  // aligned, as a connection's is
  const Status whole = check_frame_payload(*header, payload);
  require_sentence(whole);
  if (whole) require_sentence(decode(*header, payload));
}

}  // namespace kiln::fuzz
