// One program for both sides of tests/compare/encoders.mjs: it makes the maps, runs our encoders on them and
// measures what any encoder wrote.
//   encoder_table maps BAKE.exr FOLDER      ratio.png, ratio.rgba (L1x/L0 in bytes) and light.exr (L0)
//   encoder_table ours MAP                  a line an effort: encoder, megatexels a second of one core, error
//   encoder_table measure MAP FILE NAME SECONDS   the same line of a DDS or KTX2 file of another encoder
// The error of bytes is PSNR in dB; of light it is the relative mean square, (a - b)^2 / (b^2 + 1e-4 mean
// b^2).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>

#include "common/base/files.h"
#include "coordinator/output/astc/astc.h"
#include "coordinator/output/blocks/blocks.h"
#include "coordinator/output/container/container.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

template <class T>
T must(Expected<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "%s\n", result.error().message.c_str());
  std::exit(1);
}

struct Map {
  uint32_t width = 0, height = 0;
  bool light = false;
  std::vector<float> rgba;
};

Map read_map(const std::string& path) {
  Map map;
  if (path.ends_with(".exr")) {
    const Planes planes = must(read_exr(path));
    map = {planes.width, planes.height, true,
           std::vector<float>(size_t{4} * planes.width * planes.height, 1)};
    for (size_t c = 0; c < 3; ++c) {
      const auto plane = planes.plane(std::string(1, "RGB"[c]));
      for (size_t i = 0; i < plane.size(); ++i) map.rgba[4 * i + c] = plane[i];
    }
    return map;
  }
  const Texture t = must(decode_image(must(read_file(path)), path));
  map = {t.width, t.height, false, std::vector<float>(size_t{4} * t.width * t.height, 1)};
  for (size_t i = 0; i < size_t{t.width} * t.height; ++i)
    for (size_t c = 0; c < std::min(3u, t.channels); ++c)
      map.rgba[4 * i + c] = static_cast<float>(t.texels[i * t.channels + c]) / 255.0f;
  return map;
}

double error_of(const Map& map, const std::vector<float>& decoded) {
  double sum = 0, square = 0;
  const auto count = static_cast<double>(map.rgba.size()) * 3 / 4;
  for (size_t i = 0; i < map.rgba.size(); ++i)
    if (i % 4 < 3) square += double{map.rgba[i]} * map.rgba[i] / count;
  for (size_t i = 0; i < map.rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    const double d = double{decoded[i]} - map.rgba[i];
    sum += map.light ? d * d / (double{map.rgba[i]} * map.rgba[i] + 1e-4 * square) : d * d;
  }
  return map.light ? sum / count : -10 * std::log10(sum / count);
}

void print(const Map& map, const std::string& format, const std::string& name, double seconds, double error) {
  const double rate = static_cast<double>(map.rgba.size()) / 4 / seconds / 1e6;
  std::printf(map.light ? "| %s | %s | %.3g | %.3g |\n" : "| %s | %s | %.3g | %.2f dB |\n", format.c_str(),
              name.c_str(), rate, error);
}

void run_ours(const Map& map) {
  const BlockImage image{map.width, map.height, map.rgba, {}};
  const BlockMetric metric = map.light ? BlockMetric::kLog : BlockMetric::kLinear;
  const auto row = [&](const std::string& format, const char* name, BlockEffort effort, const auto& encode,
                       const auto& decode) {
    const clock_t start = std::clock();
    const Bytes blocks = must(encode(BlockChoice{effort, metric, false}));
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    print(map, format, name, seconds, error_of(map, must(decode(blocks))));
  };
  for (const auto& [effort, name] : {std::pair{BlockEffort::kFast, "Kiln fast"},
                                     {BlockEffort::kNormal, "Kiln normal"},
                                     {BlockEffort::kBest, "Kiln best"}}) {
    for (const char* format : {"bc7", "bc1", "bc6h_ufloat"}) {
      if ((std::string(format) == "bc6h_ufloat") != map.light) continue;
      const BlockFormat& f = *find_block_format(format);
      row(
          format, name, effort, [&](const BlockChoice& c) { return encode_blocks(f, image, c, true, 1); },
          [&](const Bytes& b) { return decode_blocks(f, b, map.width, map.height); });
    }
    const auto first =
        static_cast<int>(map.light ? TextureFormat::kAstc4x4Sfloat : TextureFormat::kAstc4x4Unorm);
    for (int f = first; f < first + 3; ++f) {
      const auto format = static_cast<TextureFormat>(f);
      row(
          std::string(texture_format(format).name), name, effort,
          [&](const BlockChoice& c) { return encode_astc(format, image, c, true, 1); },
          [&](const Bytes& b) { return decode_astc(format, b, map.width, map.height); });
    }
  }
}

void measure(const Map& map, const std::string& path, const std::string& name, double seconds) {
  const Bytes file = must(read_file(path));
  const TextureImages t = must(path.ends_with(".dds") ? read_dds(file) : read_ktx2(file));
  const char* format = t.format == TextureFormat::kBc1Unorm   ? "bc1"
                       : t.format == TextureFormat::kBc7Unorm ? "bc7"
                                                              : "bc6h_ufloat";
  const auto decoded = must(decode_blocks(*find_block_format(format), t.levels[0][0], t.width, t.height));
  if (t.width != map.width || t.height != map.height) std::exit(1);
  print(map, format, name, seconds, error_of(map, decoded));
}

// Texels of nobody take their block's mean: other encoders know no weights. Sides are cut to multiples of 4.
void write_maps(const std::string& bake, const fs::path& folder) {
  const Planes planes = must(read_exr(bake));
  const uint32_t width = planes.width / 4 * 4, height = planes.height / 4 * 4;
  std::vector<float> light[3];
  std::vector<uint8_t> rgb(size_t{3} * width * height), rgba(size_t{4} * width * height, 255);
  for (auto& plane : light) plane.resize(size_t{width} * height);
  for (uint32_t by = 0; by < height; by += 4)
    for (uint32_t bx = 0; bx < width; bx += 4) {
      BlockTexels ratio{}, l0{};
      for (uint32_t i = 0; i < 16; ++i) {
        const size_t from = size_t{by + i / 4} * planes.width + bx + i % 4;
        for (size_t c = 0; c < 3; ++c) {
          const std::string channel(1, "RGB"[c]);
          const float a = planes.plane("L0." + channel)[from], b = planes.plane("L1x." + channel)[from];
          l0.rgba[i][c] = a;
          ratio.rgba[i][c] = a > 0 ? std::clamp(0.5f + 0.25f * b / a, 0.0f, 1.0f) : 0.5f;
          if (a > 0) l0.weight[i] = ratio.weight[i] = 1;
        }
      }
      fill_block(l0);
      fill_block(ratio);
      for (uint32_t i = 0; i < 16; ++i)
        for (size_t c = 0; c < 3; ++c) {
          const size_t to = size_t{by + i / 4} * width + bx + i % 4;
          light[c][to] = l0.rgba[i][c];
          rgb[3 * to + c] = rgba[4 * to + c] = static_cast<uint8_t>(255 * ratio.rgba[i][c] + 0.5f);
        }
    }
  const ExrChannel channels[] = {{"R", light[0].data()}, {"G", light[1].data()}, {"B", light[2].data()}};
  if (!write_exr(folder / "light.exr", width, height, channels) ||
      !write_png(folder / "ratio.png", width, height, rgb) ||
      !write_file_atomic(folder / "ratio.rgba", std::as_bytes(std::span(rgba))))
    std::exit(1);
  std::printf("%u %u\n", width, height);
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  const std::string verb = argc > 1 ? argv[1] : "";
  if (verb == "maps" && argc == 4) {
    kiln::write_maps(argv[2], argv[3]);
  } else if (verb == "ours" && argc == 3) {
    kiln::run_ours(kiln::read_map(argv[2]));
  } else if (verb == "measure" && argc == 6) {
    kiln::measure(kiln::read_map(argv[2]), argv[3], argv[4], std::atof(argv[5]));
  } else {
    std::fprintf(stderr,
                 "usage: encoder_table maps BAKE.exr FOLDER | ours MAP | measure MAP FILE NAME SECONDS\n");
    return 2;
  }
}
