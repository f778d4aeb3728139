#include "common/wire/special_fields.h"

#include "common/wire/limits.h"
#include "common/zstd/compress.h"

namespace kiln {
namespace {

enum Codec : uint8_t { kRaw = 0, kZstd = 1 };

}  // namespace

void put_packed(ByteWriter& w, const Bytes& bytes, bool to_compress) {
  w.put(static_cast<uint32_t>(bytes.size()));
  Bytes packed;
  if (to_compress) packed = compress(bytes);
  const bool zstd = to_compress && packed.size() < bytes.size();
  w.put(zstd ? kZstd : kRaw);
  w.put_array(zstd ? packed : bytes);
}

void get_packed(FieldReader& r, Bytes& bytes, bool& compressed) {
  struct {
    uint32_t size = 0;
    uint8_t codec = 0;
  } head;
  r(head.size, head.codec);
  if (head.size > kChunkPieceBytes) r.blame("a piece larger than pieces are");
  if (head.codec > kZstd) r.blame("a codec that does not exist in this release");
  const auto packed = r.take(r.take_count(kMaxDataBytes, 1));
  if (!r.ok()) return;
  compressed = head.codec == kZstd;
  if (!compressed) {
    bytes.assign(packed.begin(), packed.end());
    if (bytes.size() != head.size) r.blame("a piece of another size than it states");
    return;
  }
  auto unpacked = decompress(packed, head.size);
  if (unpacked)
    bytes = std::move(*unpacked);
  else
    r.blame(unpacked.error().message);
}

}  // namespace kiln
