#include "common/image/exr_header.h"

#include <cstring>
#include <string>

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
  // A text that ends with a zero; false if it does not end in time.
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
  Walk ahead() const { return *this; }

 private:
  std::span<const std::byte> rest_;
};

tl::unexpected<Error> bad(const std::string& what) {
  return fail(ErrorKind::kInvalidInput, what);
}

// Whether a preview of this many bytes holds the pixels that it says.
bool is_preview_whole(Walk value, size_t size) {
  uint32_t width = 0, height = 0;
  return value.number(width) && value.number(height) && uint64_t{width} <= size && uint64_t{height} <= size &&
         uint64_t{width} * height * 4 + 8 == size;
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
    if (type == "preview" && !is_preview_whole(walk.ahead(), static_cast<size_t>(size)))
      return bad("its EXR header has a preview image of another size than it says");
    if (!walk.skip(static_cast<size_t>(size)))
      return bad(
          text("its EXR header has an attribute of {} bytes, more than the file, or than 1 MiB", size));
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
