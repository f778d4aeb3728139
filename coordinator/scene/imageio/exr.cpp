#include "coordinator/scene/imageio/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <exception>
#include <fstream>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/base/release.h"
#include "common/image/exr_header.h"

namespace kiln {
namespace {
constexpr uint64_t kMaxChannels = 64;  // at the most texels
const std::string kPrefix = "kiln:";

// OpenEXR compresses blocks of lines in parallel.
void use_all_threads() {
  static const bool set = [] {
    Imf::setGlobalThreadCount(static_cast<int>(hardware_threads()));
    return true;
  }();
  static_cast<void>(set);
}

// OpenEXR allocates as a header says: ours looks first.
Status check_header(const std::filesystem::path& path) {
  Bytes head(kMaxExrHeaderBytes);
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  if (!stream.is_open()) return fail(ErrorKind::kInvalidInput, text("{}: no such file", path.string()));
  head.resize(static_cast<size_t>(stream.gcount()));
  if (const Status header = check_exr_header(head); !header)
    return fail(ErrorKind::kInvalidInput, text("{}: {}", path.string(), header.error().message));
  return {};
}

}  // namespace

Status write_exr(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const ExrChannel> channels, ExrForm form, const ExrNotes& notes) {
  return write_atomic(path, [&](const std::filesystem::path& temporary) -> Status {
    try {
      use_all_threads();
      Imf::Header header(static_cast<int>(width), static_cast<int>(height));
      header.compression() =
          form.compression == ExrCompression::kZip ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
      header.zipCompressionLevel() = 1;  // for noise: level 4 takes twice as long for 3 % fewer bytes
      for (const auto& [name, words] : notes) header.insert(kPrefix + name, Imf::StringAttribute(words));
      header.insert(kPrefix + "version", Imf::StringAttribute(release_number()));
      Imf::FrameBuffer frame;
      std::vector<std::vector<half>> halves(form.type == ExrType::kHalf ? channels.size() : 0);
      for (size_t i = 0; i < channels.size(); ++i) {
        const ExrChannel& c = channels[i];
        if (form.type == ExrType::kHalf) {
          halves[i].assign(c.data, c.data + size_t{width} * height);
          header.channels().insert(c.name, Imf::Channel(Imf::HALF));
          frame.insert(c.name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(halves[i].data()), sizeof(half),
                                          sizeof(half) * width));
          continue;
        }
        header.channels().insert(c.name, Imf::Channel(Imf::FLOAT));
        // OpenEXR's slices are not const even for writing.
        auto* base = reinterpret_cast<char*>(const_cast<float*>(c.data));
        frame.insert(c.name, Imf::Slice(Imf::FLOAT, base, sizeof(float), sizeof(float) * width));
      }
      Imf::OutputFile file(temporary.c_str(), header);
      file.setFrameBuffer(frame);
      file.writePixels(static_cast<int>(height));
    } catch (const std::exception& e) {
      return fail(ErrorKind::kIo, text("cannot write {}: {}", path.string(), e.what()));
    }
    return {};
  });
}

Expected<ExrNotes> read_exr_notes(const std::filesystem::path& path) {
  KILN_TRY_STATUS(check_header(path));
  ExrNotes notes;
  try {
    const Imf::InputFile file(path.c_str());
    for (auto a = file.header().begin(); a != file.header().end(); ++a) {
      const std::string name = a.name();
      const auto* words = dynamic_cast<const Imf::StringAttribute*>(&a.attribute());
      if (words && name.starts_with(kPrefix)) notes[name.substr(kPrefix.size())] = words->value();
    }
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInvalidInput, text("cannot read {}: {}", path.string(), e.what()));
  }
  return notes;
}

Expected<Planes> read_exr(const std::filesystem::path& path, uint64_t max_texels) {
  KILN_TRY_STATUS(check_header(path));
  try {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const int64_t width = int64_t{window.max.x} - window.min.x + 1,
                  height = int64_t{window.max.y} - window.min.y + 1;
    if (width <= 0 || height <= 0 || static_cast<uint64_t>(width) * height > max_texels)
      return fail(ErrorKind::kInvalidInput,
                  text("{}: {}x{} texels, more than allowed", path.string(), width, height));
    const Imf::ChannelList& channels = file.header().channels();
    uint64_t channel_count = 0;
    for (auto c = channels.begin(); c != channels.end(); ++c) ++channel_count;
    if (channel_count * width * height > kMaxChannels * max_texels)
      return fail(ErrorKind::kInvalidInput, text("{}: {} channels of {}x{} texels, more than allowed",
                                                 path.string(), channel_count, width, height));
    Planes planes;
    planes.width = static_cast<uint32_t>(width);
    planes.height = static_cast<uint32_t>(height);
    for (auto c = channels.begin(); c != channels.end(); ++c) planes.add(c.name());
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < planes.names.size(); ++i) {
      frame.insert(planes.names[i], Imf::Slice::Make(Imf::FLOAT, planes.data[i].data(), window, sizeof(float),
                                                     sizeof(float) * static_cast<size_t>(width)));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return planes;
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInvalidInput, text("cannot read {}: {}", path.string(), e.what()));
  }
}

}  // namespace kiln
