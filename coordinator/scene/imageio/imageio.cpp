#include "coordinator/scene/imageio/imageio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/image/exr_header.h"
#include "coordinator/scene/imageio/avif.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxSide = 16384;
constexpr uint64_t kMaxDecodedBytes = uint64_t{1} << 30;
// A megabyte of PNG can hold a gigabyte of one colour.
constexpr uint64_t kAnyColours = uint64_t{256} << 20, kAnyRadiance = uint64_t{512} << 20, kTimesTheFile = 64;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 32;

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return fail(ErrorKind::kInvalidInput, text("{}: {}", name, what));
}

// Our own threads decode images in parallel, so the library's are turned off.
void set_up_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::attribute("limits:channels", 16);
    OIIO::attribute("limits:imagesize_MB", static_cast<int>(kMaxDecodedBytes >> 20));
  });
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

std::string last_line(std::string message) {
  while (!message.empty() && message.back() == '\n') message.pop_back();
  const size_t line = message.rfind('\n');
  return line == std::string::npos ? message : message.substr(line + 1);
}

// An image opened from memory whose size has been checked; nothing is decoded yet.
struct OpenImage {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
  std::unique_ptr<OIIO::ImageInput> input;
  uint32_t width = 0, height = 0, channels = 0;

  ~OpenImage() {
    if (input) input->close();  // before the memory is freed
  }
  OpenImage() = default;
  OpenImage(OpenImage&&) = default;
};

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

Expected<OpenImage> open_image(std::span<const std::byte> file, const std::string& name,
                               size_t channel_bytes) {
  set_up_library();
  const char* format = format_of(file);
  if (!format)
    return bad(name,
               "its content is not a supported image (PNG, JPEG, WebP, BMP, HDR, EXR; of textures AVIF)");
  if (std::string_view(format) == "openexr")
    if (const Status header = check_exr_header(file); !header) return bad(name, header.error().message);
  OpenImage image;
  image.input = OIIO::ImageInput::create(format);
  if (!image.input) return bad(name, text("this OpenImageIO cannot read {}", format));
  image.memory =
      std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<std::byte*>(file.data()), file.size());
  if (!image.input->set_ioproxy(image.memory.get()))
    return bad(name, text("this OpenImageIO cannot read {} from memory", format));
  OIIO::ImageSpec spec, config;
  config["oiio:UnassociatedAlpha"] = 1;  // glTF's alpha is not premultiplied
  if (!image.input->open(std::string("image.") + format, spec, config))
    return bad(name, text("it does not decode: {}", last_line(image.input->geterror())));
  if (spec.depth > 1) return bad(name, "it is a volume");
  KILN_TRY_STATUS(check_size(spec.width, spec.height, spec.nchannels, channel_bytes, file.size(), name));
  image.width = static_cast<uint32_t>(spec.width);
  image.height = static_cast<uint32_t>(spec.height);
  image.channels = std::min(4u, static_cast<uint32_t>(spec.nchannels));
  return image;
}

// Every channel of every texel as a T.
template <class T>
Status read_texels(OpenImage& image, OIIO::TypeDesc type, const std::string& name, std::span<T> texels) {
  KILN_CHECK(texels.size() == size_t{image.width} * image.height * image.channels);
  if (!image.input->read_image(0, 0, 0, static_cast<int>(image.channels), type, texels.data()))
    return bad(name, text("it does not decode: {}", last_line(image.input->geterror())));
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
  KILN_TRY(OpenImage image, open_image(file, name, 1));
  Texture texture;
  texture.name = name;
  texture.width = image.width;
  texture.height = image.height;
  texture.channels = image.channels;
  const size_t bytes = size_t{image.width} * image.height * image.channels;
  if (hold) hold->take(2 * bytes);
  texture.texels.resize(bytes);
  KILN_TRY_STATUS(read_texels<std::byte>(image, OIIO::TypeDesc::UINT8, name, texture.texels));
  return texture;
}

Expected<Texture> read_environment(const std::filesystem::path& path) {
  const std::string name = path.string();
  KILN_TRY(const Bytes file, read_file(path, kMaxFileBytes));
  KILN_TRY(OpenImage image, open_image(file, name, 4));
  std::vector<float> texels(size_t{image.width} * image.height * image.channels);
  KILN_TRY_STATUS(read_texels<float>(image, OIIO::TypeDesc::FLOAT, name, texels));
  const std::string_view format = format_of(file);
  const bool coded = format != "hdr" && format != "openexr";
  const uint32_t colours = image.channels >= 3 ? 3 : 1;
  std::vector<float> rgb(size_t{image.width} * image.height * 3);
  for (size_t i = 0; i < rgb.size(); ++i) {
    const float value = texels[i / 3 * image.channels + (colours == 3 ? i % 3 : 0)];
    rgb[i] = coded ? srgb_to_linear(value) : value;
  }
  KILN_TRY_STATUS(check_radiance(rgb, image.width, name));
  Texture texture;
  texture.name = path.filename().string();
  texture.width = image.width;
  texture.height = image.height;
  texture.channels = 3;
  texture.format = TexelFormat::kFloat32;
  texture.wrap_t = Wrap::kClamp;  // wraps around the horizon, clamps at the poles
  texture.texels.resize(rgb.size() * sizeof(float));
  std::memcpy(texture.texels.data(), rgb.data(), texture.texels.size());
  return texture;
}

namespace {

Expected<Bytes> encode(const char* format, uint32_t width, uint32_t height, uint32_t channels,
                       OIIO::TypeDesc type, const void* texels) {
  set_up_library();
  auto output = OIIO::ImageOutput::create(format);
  if (!output) return fail(ErrorKind::kInternal, text("this OpenImageIO cannot write {}", format));
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  OIIO::ImageSpec spec(static_cast<int>(width), static_cast<int>(height), static_cast<int>(channels), type);
  spec["oiio:UnassociatedAlpha"] = 1;
  const bool done = output->set_ioproxy(&memory) && output->open(std::string("image.") + format, spec) &&
                    output->write_image(type, texels) && output->close();
  if (!done)
    return fail(ErrorKind::kInternal, text("cannot encode {}: {}", format, last_line(output->geterror())));
  Bytes file(buffer.size());
  std::memcpy(file.data(), buffer.data(), file.size());
  return file;
}

}  // namespace

Expected<Bytes> encode_png(uint32_t width, uint32_t height, std::span<const uint8_t> texels,
                           uint32_t channels) {
  KILN_CHECK(width > 0 && height > 0 && (channels == 3 || channels == 4));
  KILN_CHECK(texels.size() == size_t{width} * height * channels);
  return encode("png", width, height, channels, OIIO::TypeDesc::UINT8, texels.data());
}

Status write_png(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const uint8_t> rgb) {
  KILN_TRY(const Bytes png, encode_png(width, height, rgb));
  return write_file_atomic(path, png);
}

}  // namespace kiln
