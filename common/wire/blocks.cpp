#include "common/wire/blocks.h"

#include "common/wire/limits.h"
#include "common/zstd/compress.h"

namespace kiln::blocks {
namespace {

enum class Codec : uint8_t { kRaw = 0, kZstd = 1 };

ByteWriter frame_writer() {
  ByteWriter w;
  w.put<uint64_t>(0);  // space for the header, which seal_frame fills
  w.put<uint64_t>(0);
  return w;
}

tl::unexpected<Error> damaged(const char* what) {
  return fail(ErrorKind::kProtocol, std::string("a ") + what + " message is not well formed");
}

}  // namespace

Bytes write(const ChunkPiece& piece) {
  ByteWriter w = frame_writer();
  w.put(piece.id);
  w.put(piece.offset);
  w.put(piece.total);
  w.put(static_cast<uint32_t>(piece.bytes.size()));
  Bytes packed;
  if (piece.compress) packed = compress(piece.bytes);
  // Data that zstd cannot shrink is sent uncompressed.
  const bool zstd = piece.compress && packed.size() < piece.bytes.size();
  w.put(zstd ? Codec::kZstd : Codec::kRaw);
  w.put_array(zstd ? packed : piece.bytes);
  return w.take();
}

Expected<Message> read_chunk_piece(std::span<const std::byte> payload) {
  ByteReader r(payload);
  ChunkPiece piece;
  piece.id = r.get<Digest>();
  piece.offset = r.get<uint64_t>();
  piece.total = r.get<uint64_t>();
  const auto size = r.get<uint32_t>();
  const auto codec = r.get<Codec>();
  piece.bytes = r.get_array<std::byte>();
  piece.compress = codec == Codec::kZstd;
  if (!r.at_end() || codec > Codec::kZstd || size > kChunkPieceBytes) return damaged("chunk");
  if (piece.compress) {
    KILN_TRY(piece.bytes, decompress(piece.bytes, size));
  }
  if (piece.bytes.size() != size || piece.total > kMaxChunkBytes || piece.offset > piece.total ||
      size > piece.total - piece.offset)
    return damaged("chunk");
  return Message(std::move(piece));
}

Bytes write(const Unit& unit) {
  ByteWriter w = frame_writer();
  w.put(unit.job);
  w.put(unit.lease);
  w.put(unit.unit.id);
  w.put(unit.unit.first_sample);
  w.put(unit.unit.sample_count);
  w.put_array(unit.unit.sites);
  if (needs_minor_2(unit)) {
    w.put(unit.unit.replicate);
    w.put(unit.unit.cache);
  }
  return w.take();
}

Expected<Message> read_unit(std::span<const std::byte> payload) {
  ByteReader r(payload);
  Unit unit;
  unit.job = r.get<uint64_t>();
  unit.lease = r.get<uint64_t>();
  unit.unit.id = r.get<uint64_t>();
  unit.unit.first_sample = r.get<uint32_t>();
  unit.unit.sample_count = r.get<uint32_t>();
  unit.unit.sites = r.get_array<uint32_t>();
  if (!r.at_end()) {
    unit.unit.replicate = r.get<uint32_t>();
    unit.unit.cache = r.get<Digest>();
  }
  if (!r.at_end() || unit.unit.replicate >= kReplicates) return damaged("unit");
  return Message(std::move(unit));
}

Bytes write(const Result& result) {
  const UnitResult& u = result.result;
  ByteWriter w = frame_writer();
  w.put(result.job);
  w.put(result.lease);
  w.put(u.unit);
  w.put(u.site_count);
  w.put(u.plane_count);
  w.put(u.rays);
  w.put(u.nonfinite);
  w.put(u.nonfinite_texel);
  w.put(u.nonfinite_sample);
  w.put(u.seconds);
  w.put(result.digest);
  w.put_array(u.moments);
  if (result.shape) w.put(result.shape);
  return w.take();
}

Expected<Message> read_result(std::span<const std::byte> payload) {
  ByteReader r(payload);
  Result result;
  UnitResult& u = result.result;
  result.job = r.get<uint64_t>();
  result.lease = r.get<uint64_t>();
  u.unit = r.get<uint64_t>();
  u.site_count = r.get<uint32_t>();
  u.plane_count = r.get<uint32_t>();
  u.rays = r.get<uint64_t>();
  u.nonfinite = r.get<uint64_t>();
  u.nonfinite_texel = r.get<uint32_t>();
  u.nonfinite_sample = r.get<uint32_t>();
  u.seconds = r.get<double>();
  result.digest = r.get<Digest>();
  u.moments = r.get_array<double>();
  if (!r.at_end()) result.shape = r.get<uint64_t>();
  if (!r.at_end() || u.moments.size() != uint64_t{u.site_count} * u.plane_count) return damaged("result");
  return Message(std::move(result));
}

Bytes write(const Request& request) {
  ByteWriter w = frame_writer();
  w.put(request.id);
  w.put_string(request.verb);
  w.put_string(request.document);
  return w.take();
}

Expected<Message> read_request(std::span<const std::byte> payload) {
  ByteReader r(payload);
  Request request;
  request.id = r.get<uint64_t>();
  request.verb = r.get_string();
  request.document = r.get_string();
  if (!r.at_end() || request.verb.size() > kMaxTextBytes || request.document.size() > kMaxDocumentBytes)
    return damaged("request");
  return Message(std::move(request));
}

Bytes write(const Reply& reply) {
  ByteWriter w = frame_writer();
  w.put(reply.id);
  w.put(static_cast<uint8_t>(reply.ok));
  w.put(static_cast<uint8_t>(reply.kind));
  w.put_string(reply.document);
  return w.take();
}

Expected<Message> read_reply(std::span<const std::byte> payload) {
  ByteReader r(payload);
  Reply reply;
  reply.id = r.get<uint64_t>();
  const auto ok = r.get<uint8_t>(), kind = r.get<uint8_t>();
  reply.document = r.get_string();
  if (!r.at_end() || ok > 1 || kind > static_cast<uint8_t>(ErrorKind::kInternal) ||
      reply.document.size() > kMaxDocumentBytes)
    return damaged("reply");
  reply.ok = ok != 0;
  reply.kind = static_cast<ErrorKind>(kind);
  return Message(std::move(reply));
}

}  // namespace kiln::blocks
