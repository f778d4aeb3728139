// One filled message of every type.
#pragma once

#include "common/wire/messages.h"

namespace kiln::test {

inline std::vector<Message> sample_messages() {
  Digest d;
  for (size_t i = 0; i < d.bytes.size(); ++i) d.bytes[i] = static_cast<uint8_t>(i * 7);
  UnitResult r;
  r.unit = 9, r.site_count = 2, r.plane_count = 3;
  r.moments = {1.5, -2.0, 1e300, 0.0, 4.0, 1e-300};
  r.rays = 1000, r.nonfinite = 1, r.nonfinite_texel = 5, r.nonfinite_sample = 6, r.seconds = 0.25;
  const std::string text(3000, 'x');
  Bytes noise;
  for (int i = 0; i < 5000; ++i) noise.push_back(std::byte(i * i >> 3 & 255));
  return {Hello{"0.1.0", "secret", "host", 12, 34, 5, "avx2", "embree 3"},
          Welcome{1, 2, 3},
          Refused{"because"},
          Job{write_job({7, d, d, {}})},
          JobClass{7, "avx2-0123"},
          JobFailed{7, ErrorKind::kNoSpace, text},
          Credits{7, 4, {5, 6}},
          ChunkRequest{{d, Digest{}, d}, true},
          UnitFailed{7, 8, 9, ErrorKind::kInternal, "why"},
          CommitAck{7, 8, d},
          Heartbeat{1, 2, 3000},
          Drain{{1, 2, 3}, "signal"},
          Goodbye{"bye"},
          Withdraw{7, {8, 9}},
          JobEnded{7, "cancelled"},
          Pace{500},
          ClientHello{"0.1.0", "secret", "ada", "desk3"},
          ClientWelcome{"0.1.0", "submit"},
          ChunkPiece{d, 10, 6000, noise, false},
          ChunkPiece{d, 0, 5000, Bytes(5000, std::byte{3}), true},
          Unit{7, 11, {9, 64, 32, {1, 2, 3, 5, 8}}},
          Unit{7, 12, {10, 64, 32, {1, 2, 3, 5, 8}, 1, d}},
          Result{7, 11, r, result_digest(r), 12},
          Request{1, "jobs", "{}"},
          Reply{1, false, ErrorKind::kUsage, "no such job"}};
}

inline Expected<Message> decode_frame(std::span<const std::byte> frame) {
  KILN_TRY(const FrameHeader header, read_frame_header(frame.first<kFrameHeaderBytes>()));
  const Bytes payload(frame.begin() + kFrameHeaderBytes, frame.end());  // aligned, as a connection's is
  KILN_TRY_STATUS(check_frame_payload(header, payload));
  return decode(header, payload);
}

}  // namespace kiln::test
