// Table for docs/encoding.md: every block format at every effort, with and without block-aware fill, on made
// lightmaps and on those given (channels R, G, B or irradiance.R, ...; black texels are nobody's).
//   blocks_table [--size N] [--metric linear|log|perceptual] [FORMAT | FILE.exr ...]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>

#include "coordinator/output/blocks/blocks.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

struct Map {
  std::string name;
  uint32_t width, height;
  std::vector<float> rgba, weight;
};

float noise(uint32_t x, uint32_t y, uint32_t k) {  // in [0, 1)
  uint32_t h = x * 0x9E3779B1u ^ y * 0x85EBCA77u ^ k * 0xC2B2AE3Du;
  h = (h ^ h >> 15) * 0x2C1B3C6Du;
  h = (h ^ h >> 12) * 0x297A2D39u;
  return static_cast<float>((h ^ h >> 15) >> 8) * 0x1p-24f;
}

// A third of the texels, in strips and corners as charts leave them, belongs to nobody and is black.
bool valid(uint32_t x, uint32_t y) {
  const uint32_t u = x % 61, v = y % 53;
  return u < 50 && v < 47 && u + v > 9;
}

template <class Light>
Map make(const char* name, uint32_t size, const Light& light) {
  Map map{name, size, size, std::vector<float>(size_t{4} * size * size),
          std::vector<float>(size_t{size} * size)};
  for (uint32_t y = 0; y < size; ++y)
    for (uint32_t x = 0; x < size; ++x) {
      const size_t i = size_t{y} * size + x;
      float* t = &map.rgba[4 * i];
      t[3] = 1;
      map.weight[i] = valid(x, y) ? 1.0f : 0.0f;
      if (valid(x, y)) light(static_cast<float>(x), static_cast<float>(y), t);
    }
  return map;
}

float smooth_step(float x) {
  const float t = std::min(std::max(x, 0.0f), 1.0f);
  return t * t * (3 - 2 * t);
}

std::vector<Map> made_maps(uint32_t size) {
  std::vector<Map> maps;
  // Lamps over a floor, `h` texels above it: light falls by (1 + (d/h)^2)^-2.
  const auto lamps = [](float x, float y, float h, float* t) {
    const float dx = std::fmod(x, 4 * h) - 2 * h, dy = std::fmod(y, 5 * h) - 2.5f * h;
    const float q = h * h / (h * h + dx * dx + dy * dy);
    t[0] = 20 * q * q;
    t[1] = 17 * q * q + 0.2f;
    t[2] = 11 * q * q + 0.5f;
  };
  maps.push_back(make("smooth", size, [&](float x, float y, float* t) { lamps(x, y, 48, t); }));
  maps.push_back(make("steep", size, [&](float x, float y, float* t) { lamps(x, y, 12, t); }));
  maps.push_back(make("soft shadow", size, [&](float x, float y, float* t) {
    lamps(x, y, 48, t);
    const float s = 0.05f + 0.95f * smooth_step((std::fmod(x + 0.4f * y, 80.0f) - 30) / 14);
    for (int c = 0; c < 3; ++c) t[c] = t[c] * s + 0.01f * static_cast<float>(c + 1);
  }));
  maps.push_back(make("hard edge 100:1", size, [](float x, float y, float* t) {
    const bool lit = std::fmod(0.9f * x + 0.37f * y, 23.0f) < 11;
    const float e = 1 + 0.2f * smooth_step(std::fmod(y, 64.0f) / 64);
    t[0] = lit ? 8 * e : 0.08f * e;
    t[1] = lit ? 7 * e : 0.085f * e;
    t[2] = lit ? 5 * e : 0.1f * e;
  }));
  maps.push_back(make("coloured bounce, 3 % noise", size, [](float x, float y, float* t) {
    const float a = smooth_step(std::fmod(x, 90.0f) / 90), b = smooth_step(std::fmod(y, 70.0f) / 70);
    const auto noisy = [&](uint32_t k) {
      return 0.97f + 0.06f * noise(static_cast<uint32_t>(x), static_cast<uint32_t>(y), k);
    };
    t[0] = (0.3f + 1.2f * a) * noisy(1);
    t[1] = (0.3f + 0.4f * b) * noisy(2);
    t[2] = (0.9f - 0.6f * a * b) * noisy(3);
  }));
  return maps;
}

bool load(const char* path, Map& map) {
  const Expected<Planes> planes = read_exr(path);
  if (!planes) {
    std::fprintf(stderr, "%s\n", planes.error().message.c_str());
    return false;
  }
  const size_t texels = size_t{planes->width} * planes->height;
  map = {std::string(path).substr(std::string(path).rfind('/') + 1), planes->width, planes->height,
         std::vector<float>(4 * texels, 1.0f), std::vector<float>(texels)};
  for (size_t c = 0; c < 3; ++c) {
    const std::string channel = std::string(1, "RGB"[c]);
    const auto named = std::find_if(planes->names.begin(), planes->names.end(), [&](const std::string& name) {
      return name == channel || name == "irradiance." + channel;
    });
    if (named == planes->names.end()) {
      std::fprintf(stderr, "%s has no channel %s\n", path, channel.c_str());
      return false;
    }
    const std::vector<float>& plane = planes->data[static_cast<size_t>(named - planes->names.begin())];
    for (size_t i = 0; i < texels; ++i) {
      map.rgba[4 * i + c] = plane[i];
      if (plane[i] != 0) map.weight[i] = 1;
    }
  }
  return true;
}

// Values of a format for [0, 1] are those of the map over its largest.
void normalise(Map& map) {
  float largest = 0;
  for (const float v : map.rgba) largest = std::max(largest, v);
  for (float& v : map.rgba) v /= largest;
}

struct Errors {
  double log_squares = 0, rel_squares = 0, values = 0;
  double of_levels = 0;                 // relMSE that 16 even levels over each block's range would leave
  double of_range = 0, of_largest = 0;  // the worst value of any block, against that block
  double above = 0, blocks = 0;         // blocks whose worst is above 2 % of the range
  double low = 1e30, high = 0;

  double rmse() const { return std::sqrt(log_squares / values); }
  double psnr() const { return 20 * std::log10((std::log2(high) - std::log2(low)) / rmse()); }
};

constexpr double kDark = 1e-4;  // of logarithms and of relative errors: less is as good as black

// Of the colours that the format has, of texels with weight. Ranges are those of the block's channels, each
// its own.
Errors compare(const BlockFormat& format, const Map& map, const std::vector<float>& decoded) {
  Errors e;
  for (uint32_t by = 0; by < map.height; by += 4)
    for (uint32_t bx = 0; bx < map.width; bx += 4) {
      double range = 0, largest = 0, worst = 0;
      for (size_t c = 0; c < std::min(format.channels, 3u); ++c) {
        double low = 1e30, high = 0, count = 0;
        for (uint32_t i = 0; i < 16; ++i) {
          const size_t x = bx + i % 4, y = by + i / 4;
          if (x >= map.width || y >= map.height || !(map.weight[y * map.width + x] > 0)) continue;
          const size_t at = 4 * (y * map.width + x) + c;
          const double a = std::max(double{map.rgba[at]}, kDark), b = std::max(double{decoded[at]}, kDark);
          low = std::min(low, a);
          high = std::max(high, a);
          worst = std::max(worst, std::abs(b - a));
          e.log_squares += std::pow(std::log2(b / a), 2);
          e.rel_squares += std::pow((b - a) / a, 2);
          ++count;
        }
        if (count == 0) continue;
        e.of_levels += count * std::pow(std::log(high / low) / 15, 2) / 12;
        e.values += count;
        e.low = std::min(e.low, low);
        e.high = std::max(e.high, high);
        range = std::max(range, high - low);
        largest = std::max(largest, high);
      }
      if (!(range > 0)) continue;
      e.of_range = std::max(e.of_range, worst / range);
      e.of_largest = std::max(e.of_largest, worst / largest);
      e.above += worst > 0.02 * range;
      ++e.blocks;
    }
  return e;
}

bool row(const BlockFormat& format, const Map& map, const BlockChoice& choice, bool fill) {
  constexpr const char* kEfforts[] = {"fast", "normal", "best"};
  // Processor time of this one thread: others on the machine take nothing from it.
  const std::clock_t begin = std::clock();
  const auto blocks = encode_blocks(format, {map.width, map.height, map.rgba, map.weight}, choice, fill, 1);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (!blocks) {
    std::fprintf(stderr, "%s: %s\n", map.name.c_str(), blocks.error().message.c_str());
    return false;
  }
  const Errors e = compare(format, map, *decode_blocks(format, *blocks, map.width, map.height, 1));
  std::printf("| %s | %s | %s%s | %.4f | %.1f | %.2e | %.2e | %.1f %% | %.1f %% | %.0f %% | %.2f |\n",
              std::string(format.name).c_str(), map.name.c_str(), kEfforts[int(choice.effort)],
              fill ? "" : ", no fill", e.rmse(), e.psnr(), e.rel_squares / e.values, e.of_levels / e.values,
              100 * e.of_range, 100 * e.of_largest, 100 * e.above / e.blocks,
              map.width * map.height / seconds / 1e6);
  std::fflush(stdout);
  return true;
}

int run(int argc, char** argv) {
  uint32_t size = 512;
  BlockChoice choice;
  std::vector<const BlockFormat*> formats;
  std::vector<Map> maps;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--size" && i + 1 < argc) {
      size = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else if (word == "--metric" && i + 1 < argc) {
      const std::string metric = argv[++i];
      choice.metric = metric == "linear" ? BlockMetric::kLinear
                      : metric == "log"  ? BlockMetric::kLog
                                         : BlockMetric::kPerceptual;
    } else if (const BlockFormat* format = find_block_format(word)) {
      formats.push_back(format);
    } else if (!load(argv[i], maps.emplace_back())) {
      return 1;
    }
  }
  if (formats.empty())
    for (const BlockFormat& format : block_formats()) formats.push_back(&format);
  if (maps.empty()) maps = made_maps(size);
  std::printf(
      "| format | map | effort | RMSE log2 | PSNR log2, dB | relMSE | of 16 levels | worst / range | "
      "worst / largest | blocks above 2 %% | Mtexel/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const BlockFormat* format : formats)
    for (Map map : maps) {
      if (format->highest <= 1) normalise(map);
      for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest})
        for (const bool fill : {true, false}) {
          choice.effort = effort;
          if (!row(*format, map, choice, fill)) return 1;
        }
    }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
