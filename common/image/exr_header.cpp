#include "common/image/exr_header.h"

#include <cstring>
#include <string>
#include <utility>

#include "common/base/bytes.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint32_t kMagic = 20000630, kMultiPart = 0x1000;
constexpr size_t kMaxName = 255;

class Walk {
 public:
  explicit Walk(std::span<const std::byte> bytes) : rest_(bytes) {}
  template <class T>
  bool number(T& value) {
    if (rest_.size() < sizeof value) return false;
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_ = rest_.subspan(sizeof value);
    return true;
  }
  // Reads a zero-terminated string; false if it is not terminated within bounds.
  bool word(std::string& value) {
    value.clear();
    for (size_t i = 0; i < rest_.size() && i <= kMaxName; ++i) {
      if (rest_[i] == std::byte{0}) {
        rest_ = rest_.subspan(i + 1);
        return true;
      }
      value += static_cast<char>(rest_[i]);
    }
    return false;
  }
  bool skip(size_t size) {
    if (size > rest_.size()) return false;
    rest_ = rest_.subspan(size);
    return true;
  }

 private:
  std::span<const std::byte> rest_;
};

tl::unexpected<Error> bad(const std::string& what) {
  return fail(ErrorKind::kInvalidInput, what);
}

// Bytes of types of one size, which the library reads whatever size the attribute states.
constexpr std::pair<std::string_view, size_t> kSizes[] = {
    {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
    {"compression", 1}, {"double", 8},   {"envmap", 1},
    {"float", 4},       {"int", 4},      {"keycode", 28},
    {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
    {"m44f", 64},       {"m44d", 128},   {"rational", 8},
    {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
    {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
    {"v3f", 12},        {"v3d", 24},     {"deepImageState", 1}};

// Whether a preview of this many bytes holds the pixels that it says.
bool is_preview_whole(Walk value, size_t size) {
  uint32_t width = 0, height = 0;
  return value.number(width) && value.number(height) && uint64_t{width} <= size && uint64_t{height} <= size &&
         uint64_t{width} * height * 4 + 8 == size;
}

// Whether a list of channels (a name and 16 bytes each, then an empty name) is exactly of this many bytes.
bool is_channel_list_whole(Walk value, size_t size) {
  std::string name;
  for (size_t used = 0; used < size;) {
    if (!value.word(name)) return false;
    used += name.size() + 1;
    if (name.empty()) return used == size;
    if (!value.skip(16)) return false;
    used += 16;
  }
  return false;
}

// Whether the library reads no more, and takes no more memory, than the attribute's size.
bool is_value_whole(const std::string& type, const Walk& value, size_t size) {
  for (const auto& [name, bytes] : kSizes)
    if (type == name) return size == bytes;
  if (type == "preview") return is_preview_whole(value, size);
  if (type == "chlist") return is_channel_list_whole(value, size);
  return type != "idmanifest";  // compressed object names: not used
}

// One header, with the empty name at its end; `empty` if it has nothing else.
Status walk_header(Walk& walk, bool& empty) {
  std::string name, type;
  for (empty = true;; empty = false) {
    if (!walk.word(name)) return bad("its EXR header does not end within the file, or within 1 MiB");
    if (name.empty()) return {};
    int32_t size = 0;
    if (!walk.word(type) || !walk.number(size) || size < 0)
      return bad("its EXR header has an attribute that is not well formed");
    const Walk value = walk;
    if (!walk.skip(static_cast<size_t>(size)))
      return bad(
          text("its EXR header has an attribute of {} bytes, more than the file, or than 1 MiB", size));
    if (!is_value_whole(type, value, static_cast<size_t>(size)))
      return bad("its EXR header has an attribute of another size than its type has");
  }
}

}  // namespace

Status check_exr_header(std::span<const std::byte> head) {
  Walk walk(head.first(std::min(head.size(), kMaxExrHeaderBytes)));
  uint32_t magic = 0, version = 0;
  if (!walk.number(magic) || magic != kMagic || !walk.number(version)) return bad("it is not an EXR file");
  bool empty = false;
  KILN_TRY_STATUS(walk_header(walk, empty));
  while ((version & kMultiPart) && !empty) KILN_TRY_STATUS(walk_header(walk, empty));
  return {};
}

}  // namespace kiln
