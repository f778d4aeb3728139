#include "tests/container/oiio_dds.h"

#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace kiln::test {
namespace {

template <class T>
std::vector<T> rgba(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, int level, OIIO::TypeDesc type,
                    T one) {
  const auto channels = static_cast<size_t>(spec.nchannels);
  const size_t texels = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height);
  std::vector<T> raw(texels * channels), out(4 * texels, T{0});
  if (!input.read_image(0, level, 0, spec.nchannels, type, raw.data())) return {};
  for (size_t i = 0; i < texels; ++i) {
    out[4 * i + 3] = one;
    for (size_t c = 0; c < channels && c < 4; ++c) out[4 * i + c] = raw[i * channels + c];
  }
  return out;
}

}  // namespace

DdsPicture oiio_read_dds(const Bytes& file, int level) {
  static int number = 0;
  const auto path = std::filesystem::temp_directory_path() /
                    ("kiln-" + std::to_string(::getpid()) + "-" + std::to_string(number++) + ".dds");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  DdsPicture picture;
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  auto input = OIIO::ImageInput::open(path.string(), &config);
  if (input) {
    while (input->seek_subimage(0, picture.levels)) ++picture.levels;
    if (input->seek_subimage(0, level)) {
      const OIIO::ImageSpec spec = input->spec();
      picture.width = spec.width;
      picture.height = spec.height;
      if (spec.format == OIIO::TypeDesc::UINT8)
        picture.bytes = rgba<uint8_t>(*input, spec, level, OIIO::TypeDesc::UINT8, 255);
      picture.floats = rgba<float>(*input, spec, level, OIIO::TypeDesc::FLOAT, 1.0f);
    }
    picture.error = input->geterror();
    input->close();
  } else {
    picture.error = OIIO::geterror();
  }
  std::filesystem::remove(path);
  return picture;
}

}  // namespace kiln::test
