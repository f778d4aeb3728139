// u8 mode and filter, u16 stride, u32 count, then packed data of EXT_meshopt_compression.
#include "coordinator/scene/document/meshopt.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_meshopt(std::span<const std::byte> data) {
  constexpr size_t kMost = size_t{1} << 24;  // bytes unpacked: enough to meet every path
  ByteReader r(data);
  const auto mode = r.get<uint8_t>(), filter = r.get<uint8_t>();
  const auto stride = r.get<uint16_t>();
  const auto count = r.get<uint32_t>();
  if (!r.ok()) return;
  const MeshoptLayout layout{static_cast<MeshoptMode>(mode % 3), static_cast<MeshoptFilter>(filter % 4),
                             count, stride};
  const Status allowed = check_meshopt(layout);
  require_sentence(allowed);
  const auto packed = data.subspan(8);
  if (!allowed || uint64_t{count} * stride > kMost) return;
  Bytes out(size_t{count} * stride);
  const Status done = unpack_meshopt(layout, packed, out);
  require_sentence(done);
  if (done) require(count <= most_meshopt_elements(layout, packed.size()), "the bound of elements holds");
}

}  // namespace kiln::fuzz
