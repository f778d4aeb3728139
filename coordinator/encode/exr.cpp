#include "coordinator/encode/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

#include <exception>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {

Status write_exr(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const ExrChannel> channels) {
  return write_atomic(path, [&](const std::filesystem::path& temporary) -> Status {
    try {
      Imf::Header header(static_cast<int>(width), static_cast<int>(height));
      header.compression() = Imf::ZIP_COMPRESSION;
      Imf::FrameBuffer frame;
      for (const ExrChannel& c : channels) {
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

Expected<Planes> read_exr(const std::filesystem::path& path, uint64_t max_texels) {
  try {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const int64_t width = int64_t{window.max.x} - window.min.x + 1,
                  height = int64_t{window.max.y} - window.min.y + 1;
    if (width <= 0 || height <= 0 || static_cast<uint64_t>(width) * height > max_texels)
      return fail(ErrorKind::kInvalidInput,
                  text("{}: {}x{} texels, more than allowed", path.string(), width, height));
    Planes planes;
    planes.width = static_cast<uint32_t>(width);
    planes.height = static_cast<uint32_t>(height);
    const Imf::ChannelList& channels = file.header().channels();
    for (auto c = channels.begin(); c != channels.end(); ++c) planes.add(c.name());
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < planes.names.size(); ++i) {
      float* base = planes.data[i].data() - window.min.x - window.min.y * width;
      frame.insert(planes.names[i], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(base), sizeof(float),
                                               sizeof(float) * width));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return planes;
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInvalidInput, text("cannot read {}: {}", path.string(), e.what()));
  }
}

}  // namespace kiln
