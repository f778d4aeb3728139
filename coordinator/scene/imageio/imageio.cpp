#include "coordinator/scene/imageio/imageio.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/image/exr_header.h"
#include "coordinator/scene/imageio/avif.h"
#include "coordinator/scene/imageio/image_library.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxSide = 16384;
// A megabyte of PNG can hold a gigabyte of one colour.
constexpr uint64_t kAnyColours = uint64_t{256} << 20, kAnyRadiance = uint64_t{512} << 20, kTimesTheFile = 64;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 32;

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return fail(ErrorKind::kInvalidInput, text("{}: {}", name, what));
}

// The decoder is chosen by content, and only among these, to limit the attack surface.
const char* format_of(std::span<const std::byte> file) {
  const std::string_view head(reinterpret_cast<const char*>(file.data()), std::min<size_t>(file.size(), 16));
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return "png";
  if (head.starts_with("\xff\xd8\xff")) return "jpeg";
  if (head.starts_with("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return "webp";
  if (head.starts_with("BM")) return "bmp";
  if (head.starts_with("#?")) return "hdr";
  if (head.starts_with("\x76\x2f\x31\x01")) return "openexr";
  return nullptr;
}

Status check_size(int64_t wide, int64_t high, int64_t channels, size_t channel_bytes, size_t file_bytes,
                  const std::string& name) {
  if (wide < 1 || high < 1 || channels < 1)
    return bad(name, text("it has {} x {} texels of {} channels", wide, high, channels));
  const auto width = static_cast<uint64_t>(wide), height = static_cast<uint64_t>(high);
  const uint64_t bytes = width * height * static_cast<uint64_t>(channels) * channel_bytes;
  if (width > kMaxSide || height > kMaxSide || bytes > kMaxDecodedBytes)
    return bad(name, text("{} x {} texels are more than the limits (16384 a side, 1 GiB)", width, height));
  const uint64_t any = channel_bytes == 1 ? kAnyColours : kAnyRadiance;
  if (bytes > any + kTimesTheFile * file_bytes)
    return bad(name,
               text("{} x {} texels would take {} MiB, more than a file of {} KiB may take ({} MiB and {} "
                    "times its size): scale it down",
                    width, height, bytes >> 20, (file_bytes >> 10) + 1, any >> 20, kTimesTheFile));
  return {};
}

// Decodes a file. `place` is told how many texels and how many channels of each there will be, once these are
// within the limits, and returns where they go.
Status read(std::span<const std::byte> file, const std::string& name, ChannelType type,
            const std::function<void*(uint32_t width, uint32_t height, uint32_t channels)>& place) {
  const char* format = format_of(file);
  if (!format)
    return bad(name,
               "its content is not a supported image (PNG, JPEG, WebP, BMP, HDR, EXR; of textures AVIF)");
  if (std::string_view(format) == "openexr")
    if (const Status header = check_exr_header(file); !header) return bad(name, header.error().message);
  KILN_TRY(const ImageLibrary* library, image_library());
  Status size_is_good;
  const std::string wrong = library->read(format, file, type, [&](const ImageSize& size) -> void* {
    if (size.is_volume)
      size_is_good = bad(name, "it is a volume");
    else
      size_is_good = check_size(size.width, size.height, size.channels,
                                type == ChannelType::kFloat32 ? sizeof(float) : 1, file.size(), name);
    if (!size_is_good) return nullptr;
    return place(static_cast<uint32_t>(size.width), static_cast<uint32_t>(size.height),
                 static_cast<uint32_t>(std::min(size.channels, kReadChannels)));
  });
  KILN_TRY_STATUS(size_is_good);
  if (!wrong.empty()) return bad(name, wrong);
  return {};
}

Status check_radiance(const std::vector<float>& rgb, uint32_t width, const std::string& name) {
  for (size_t i = 0; i < rgb.size(); ++i) {
    if (std::isfinite(rgb[i]) && rgb[i] >= 0) continue;
    const char* what = std::isnan(rgb[i]) ? "NaN" : std::isinf(rgb[i]) ? "infinite" : "negative";
    const size_t texel = i / 3;
    return bad(name, text("texel ({}, {}), counted from the top left, is {} in channel {}", texel % width,
                          texel / width, what, "RGB"[i % 3]));
  }
  return {};
}

}  // namespace

Expected<Texture> decode_image(std::span<const std::byte> file, const std::string& name,
                               MemoryGate::Hold* hold) {
  if (is_avif(file))
    return decode_avif(file, name, [&](uint32_t width, uint32_t height, uint32_t channels) -> Status {
      KILN_TRY_STATUS(check_size(width, height, channels, 1, file.size(), name));
      if (hold) hold->take(2 * uint64_t{width} * height * channels);
      return {};
    });
  Texture texture;
  texture.name = name;
  KILN_TRY_STATUS(
      read(file, name, ChannelType::kUint8, [&](uint32_t width, uint32_t height, uint32_t channels) {
        texture.width = width;
        texture.height = height;
        texture.channels = channels;
        const size_t bytes = size_t{width} * height * channels;
        if (hold) hold->take(2 * bytes);
        texture.texels.resize(bytes);
        return texture.texels.data();
      }));
  return texture;
}

Expected<Texture> read_environment(const std::filesystem::path& path) {
  const std::string name = path.string();
  KILN_TRY(const Bytes file, read_file(path, kMaxFileBytes));
  Texture texture;
  std::vector<float> texels;
  uint32_t channels = 0;
  KILN_TRY_STATUS(
      read(file, name, ChannelType::kFloat32, [&](uint32_t width, uint32_t height, uint32_t of_each) {
        texture.width = width;
        texture.height = height;
        channels = of_each;
        texels.resize(size_t{width} * height * channels);
        return texels.data();
      }));
  const std::string_view format = format_of(file);
  const bool coded = format != "hdr" && format != "openexr";
  const uint32_t colours = channels >= 3 ? 3 : 1;
  std::vector<float> rgb(size_t{texture.width} * texture.height * 3);
  for (size_t i = 0; i < rgb.size(); ++i) {
    const float value = texels[i / 3 * channels + (colours == 3 ? i % 3 : 0)];
    rgb[i] = coded ? srgb_to_linear(value) : value;
  }
  KILN_TRY_STATUS(check_radiance(rgb, texture.width, name));
  texture.name = path.filename().string();
  texture.channels = 3;
  texture.format = TexelFormat::kFloat32;
  texture.wrap_t = Wrap::kClamp;  // wraps around the horizon, clamps at the poles
  texture.texels.resize(rgb.size() * sizeof(float));
  std::memcpy(texture.texels.data(), rgb.data(), texture.texels.size());
  return texture;
}

Expected<Bytes> encode_png(uint32_t width, uint32_t height, std::span<const uint8_t> texels,
                           uint32_t channels) {
  KILN_CHECK(width > 0 && height > 0 && (channels == 3 || channels == 4));
  KILN_CHECK(texels.size() == size_t{width} * height * channels);
  KILN_TRY(const ImageLibrary* library, image_library());
  std::vector<unsigned char> made;
  const std::string wrong =
      library->write("png", {width, height, channels}, ChannelType::kUint8, texels.data(), made);
  if (!wrong.empty()) return fail(ErrorKind::kInternal, wrong);
  Bytes file(made.size());
  std::memcpy(file.data(), made.data(), file.size());
  return file;
}

Status write_png(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const uint8_t> rgb) {
  KILN_TRY(const Bytes png, encode_png(width, height, rgb));
  return write_file_atomic(path, png);
}

}  // namespace kiln
