// OpenImageIO, as a library that is loaded when the first image is read or written. With all that Debian's
// build of it links it takes 0.2 s and 130 MB, and most commands see no image. Only oiio.cpp includes it, and
// is the module kiln-images.so.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

constexpr int64_t kReadChannels = 4;                      // at most, of each texel
constexpr uint64_t kMaxDecodedBytes = uint64_t{1} << 30;  // of an image

struct ImageSize {
  int64_t width = 0, height = 0, channels = 0;
  bool is_volume = false;
};
enum class ChannelType : uint8_t { kUint8, kFloat32 };

// What the module gives. Formats are OpenImageIO's names ("png"). Both return what is wrong, or nothing.
struct ImageLibrary {
  // Decodes a file. `place` is told its size before anything is decoded, and returns where the texels go, row
  // by row and of each at most kReadChannels channels, or nullptr to leave it.
  std::string (*read)(const char* format, std::span<const std::byte> file, ChannelType type,
                      const std::function<void*(const ImageSize&)>& place);
  std::string (*write)(const char* format, const ImageSize& size, ChannelType type, const void* texels,
                       std::vector<unsigned char>& file);
};

// The library, loaded at the first call. Error (kInternal): where it was looked for.
Expected<const ImageLibrary*> image_library();

}  // namespace kiln
