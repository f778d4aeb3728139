#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/zstd/compress.h"
#include "coordinator/output/container/checks.h"
#include "coordinator/output/container/ktx2_descriptor.h"
#include "coordinator/output/container/ktx2_file.h"

namespace kiln {
namespace {

void pad(Bytes& bytes, size_t multiple) {
  bytes.resize((bytes.size() + multiple - 1) / multiple * multiple, std::byte{0});
}

template <class T>
void append(Bytes& bytes, const T& value) {
  const auto* p = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), p, p + sizeof value);
}

// Sorted by code points of the keys, which is the order of UTF-8's bytes; values end with a zero (3.11).
Expected<Bytes> key_values(std::vector<KtxNote> notes, bool is_volume) {
  for (const KtxNote& note : notes) {
    const std::string head = note.key.substr(0, 3);
    if (note.key.empty() || note.key.find('\0') != std::string::npos || head == "KTX" || head == "ktx")
      return bad_texture(
          text("\"{}\" cannot be a key of a KTX2 file: keys are not empty, have no zero and do not "
               "begin with KTX",
               note.key));
  }
  notes.push_back({"KTXorientation", is_volume ? "rdi" : "rd"});
  notes.push_back({"KTXwriter", "Kiln"});
  std::sort(notes.begin(), notes.end(), [](const KtxNote& a, const KtxNote& b) { return a.key < b.key; });
  Bytes bytes;
  for (size_t i = 0; i < notes.size(); ++i) {
    const auto& [key, value] = notes[i];
    if (i > 0 && key == notes[i - 1].key) return bad_texture(text("the key \"{}\" is given twice", key));
    append(bytes, static_cast<uint32_t>(key.size() + value.size() + 2));
    for (const std::string& part : {key, value}) {
      const auto raw = bytes_of(part);
      bytes.insert(bytes.end(), raw.begin(), raw.end());
      bytes.push_back(std::byte{0});
    }
    pad(bytes, 4);
  }
  return bytes;
}

}  // namespace

Expected<Bytes> write_ktx2(const TextureImages& texture, int zstd, const std::vector<KtxNote>& notes) {
  KILN_TRY_STATUS(check_images(texture));
  KILN_CHECK(zstd >= 0 && zstd <= 19);
  const TextureFormatInfo& format = texture_format(texture.format);
  const auto level_count = static_cast<uint32_t>(texture.levels.size());
  const std::vector<uint32_t> descriptor = ktx2_descriptor(texture.format);
  if (texture.is_volume && level_count > 1) return bad_texture("volumes are written without mip levels");
  KILN_TRY(const Bytes pairs, key_values(notes, texture.is_volume));

  Ktx2Header header{};
  header.identifier = kKtx2Identifier;
  header.vk_format = format.vulkan;
  header.type_size = ktx2_type_size(texture.format);
  header.width = texture.width;
  header.height = texture.height;
  header.depth = texture.is_volume ? texture.layers() : 0;
  header.layers = !texture.is_volume && texture.layers() > 1 ? texture.layers() : 0;  // 0: not an array
  header.faces = 1;
  header.levels = level_count;
  header.supercompression = zstd > 0 ? kKtx2Zstd : kKtx2None;
  header.dfd_offset = static_cast<uint32_t>(sizeof header + level_count * sizeof(Ktx2Level));
  header.dfd_bytes = static_cast<uint32_t>(descriptor.size() * 4);
  header.kvd_offset = header.dfd_offset + header.dfd_bytes;
  header.kvd_bytes = static_cast<uint32_t>(pairs.size());

  Bytes file;
  append(file, header);
  file.resize(header.dfd_offset);  // the level index, known at the end
  const auto words = bytes_of(descriptor);
  file.insert(file.end(), words.begin(), words.end());
  file.insert(file.end(), pairs.begin(), pairs.end());
  std::vector<Ktx2Level> index(level_count);
  for (uint32_t level = level_count; level-- > 0;) {  // smallest first
    Bytes data;
    for (const Bytes& image : texture.levels[level]) data.insert(data.end(), image.begin(), image.end());
    index[level].unpacked_bytes = data.size();
    if (zstd > 0)
      data = compress(data, zstd);
    else
      pad(file, format.bytes);  // lcm of the block and 4: all blocks are multiples of 4
    index[level].offset = file.size();
    index[level].bytes = data.size();
    file.insert(file.end(), data.begin(), data.end());
  }
  std::memcpy(&file[sizeof header], index.data(), index.size() * sizeof(Ktx2Level));
  return file;
}

}  // namespace kiln
