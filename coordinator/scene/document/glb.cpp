#include "coordinator/scene/document/glb.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {
namespace {

constexpr uint32_t kMagic = 0x46546c67;  // "glTF"
constexpr uint32_t kJson = 0x4e4f534a;
constexpr uint32_t kBin = 0x004e4942;
constexpr size_t kHeaderBytes = 12, kChunkBytes = 8;

uint32_t word_at(std::span<const std::byte> file, size_t offset) {
  uint32_t word;
  std::memcpy(&word, file.data() + offset, sizeof word);
  return word;
}

size_t padded(size_t size) {
  return (size + 3) & ~size_t{3};
}

}  // namespace

bool is_glb(std::span<const std::byte> file) {
  return file.size() >= 4 && word_at(file, 0) == kMagic;
}

Expected<GlbParts> read_glb(std::span<const std::byte> file, const std::string& name) {
  const auto bad = [&](const std::string& what) {
    return fail(ErrorKind::kInvalidInput, text("{}: {}", name, what));
  };
  if (file.size() < kHeaderBytes)
    return bad(text("truncated: a binary glTF has a header of 12 bytes, the file has {}", file.size()));
  const uint32_t version = word_at(file, 4), length = word_at(file, 8);
  if (version != 2) return bad(text("binary glTF version {} is not supported, only 2 is", version));
  if (length > file.size())
    return bad(text("truncated: header says {} bytes, the file has {}", length, file.size()));
  if (length < kHeaderBytes) return bad(text("corrupt: header says the file has {} bytes", length));

  GlbParts parts;
  size_t offset = kHeaderBytes;
  for (size_t chunk = 0; length - offset >= kChunkBytes; ++chunk) {
    const uint32_t size = word_at(file, offset), type = word_at(file, offset + 4);
    offset += kChunkBytes;
    if (size > length - offset)
      return bad(text("corrupt: chunk {} says {} bytes, {} follow", chunk, size, length - offset));
    const auto data = file.subspan(offset, size);
    if (chunk == 0 && type != kJson) return bad("corrupt: the first chunk is not JSON");
    if (chunk == 0) parts.json = {reinterpret_cast<const char*>(data.data()), data.size()};
    if (chunk > 0 && type == kBin && !parts.binary) parts.binary = data;
    offset += std::min<size_t>(padded(size), length - offset);  // other chunk types are extensions: skipped
  }
  if (parts.json.empty()) return bad("corrupt: there is no JSON chunk");
  return parts;
}

Bytes write_glb(const std::string& json, const Bytes& buffer) {
  const size_t json_size = padded(json.size()), bin_size = padded(buffer.size());
  const size_t total = kHeaderBytes + kChunkBytes + json_size + (buffer.empty() ? 0 : kChunkBytes + bin_size);
  KILN_CHECK(total < uint64_t{1} << 32);
  ByteWriter w;
  w.put(kMagic);
  w.put(uint32_t{2});
  w.put(static_cast<uint32_t>(total));
  w.put(static_cast<uint32_t>(json_size));
  w.put(kJson);
  Bytes out = w.take();
  out.reserve(total);
  const auto append = [&out](std::span<const std::byte> data, size_t size, std::byte padding) {
    out.insert(out.end(), data.begin(), data.end());
    out.resize(out.size() + size - data.size(), padding);
  };
  append(bytes_of(json), json_size, std::byte{' '});
  if (!buffer.empty()) {
    const uint32_t head[2] = {static_cast<uint32_t>(bin_size), kBin};
    append(std::as_bytes(std::span(head)), sizeof head, std::byte{0});
    append(buffer, bin_size, std::byte{0});
  }
  return out;
}

}  // namespace kiln
