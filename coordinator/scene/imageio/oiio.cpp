// The module kiln-images.so. The only user of OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>
#include <mutex>

#include "coordinator/scene/imageio/image_library.h"

namespace kiln {
namespace {

// Of zlib. Level 6, the default, takes twice as long for 7 % fewer bytes (scene_unlit.glb of the classroom).
constexpr int kPngLevel = 4;

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

std::string last_line(std::string message) {
  while (!message.empty() && message.back() == '\n') message.pop_back();
  const size_t line = message.rfind('\n');
  return line == std::string::npos ? message : message.substr(line + 1);
}

std::string file_name(const char* format) {
  return std::string("image.") + format;
}

// OpenImageIO 2.4 copies from outside the memory where a file names a place past its end.
class Memory final : public OIIO::Filesystem::IOMemReader {
 public:
  explicit Memory(std::span<const std::byte> file)
      : IOMemReader(const_cast<std::byte*>(file.data()), file.size()) {}
  size_t pread(void* to, size_t bytes, int64_t offset) override {
    return offset < 0 || static_cast<uint64_t>(offset) >= size() ? 0 : IOMemReader::pread(to, bytes, offset);
  }
};

OIIO::TypeDesc described(ChannelType type) {
  return type == ChannelType::kFloat32 ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
}

std::string read(const char* format, std::span<const std::byte> file, ChannelType type,
                 const std::function<void*(const ImageSize&)>& place) {
  set_up_library();
  Memory memory(file);
  const auto input = OIIO::ImageInput::create(format);  // closed before the memory ends
  if (!input || !input->set_ioproxy(&memory)) return std::string("this OpenImageIO cannot read ") + format;
  OIIO::ImageSpec spec, config;
  config["oiio:UnassociatedAlpha"] = 1;  // glTF's alpha is not premultiplied
  if (!input->open(file_name(format), spec, config))
    return "it does not decode: " + last_line(input->geterror());
  void* const texels = place({spec.width, spec.height, spec.nchannels, spec.depth > 1});
  if (texels && !input->read_image(0, 0, 0, std::min(static_cast<int>(kReadChannels), spec.nchannels),
                                   described(type), texels))
    return "it does not decode: " + last_line(input->geterror());
  return {};
}

std::string write(const char* format, const ImageSize& size, ChannelType type, const void* texels,
                  std::vector<unsigned char>& file) {
  set_up_library();
  OIIO::Filesystem::IOVecOutput memory(file);
  const auto output = OIIO::ImageOutput::create(format);
  if (!output) return std::string("this OpenImageIO cannot write ") + format;
  OIIO::ImageSpec spec(static_cast<int>(size.width), static_cast<int>(size.height),
                       static_cast<int>(size.channels), described(type));
  spec["oiio:UnassociatedAlpha"] = 1;
  spec["png:compressionLevel"] = kPngLevel;
  const bool done = output->set_ioproxy(&memory) && output->open(file_name(format), spec) &&
                    output->write_image(described(type), texels) && output->close();
  return done ? std::string() : std::string("cannot encode ") + format + ": " + last_line(output->geterror());
}

}  // namespace
}  // namespace kiln

extern "C" const kiln::ImageLibrary* kiln_image_library() {
  static constexpr kiln::ImageLibrary kLibrary{kiln::read, kiln::write};
  return &kLibrary;
}
