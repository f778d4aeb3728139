// Table for docs/encoding.md: block formats on synthetic lightmaps.
//   blocks_table [--size N] [FORMAT ...]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

#include "coordinator/blocks/blocks.h"

namespace kiln {
namespace {

struct Map {
  std::string name;
  uint32_t size;
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
  Map map{name, size, std::vector<float>(size_t{4} * size * size), std::vector<float>(size_t{size} * size)};
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

float step(float x) {
  const float t = std::min(std::max(x, 0.0f), 1.0f);
  return t * t * (3 - 2 * t);
}

std::vector<Map> synthetic(uint32_t size) {
  std::vector<Map> maps;
  // Light of lamps over a floor, a hundred to one from under a lamp to between two.
  const auto lamps = [](float x, float y, float* t) {
    const float dx = std::fmod(x, 96.0f) - 48, dy = std::fmod(y, 128.0f) - 64;
    const float h = 12, q = h * h / (h * h + dx * dx + dy * dy);
    t[0] = 20 * q * q;
    t[1] = 17 * q * q + 0.02f;
    t[2] = 11 * q * q + 0.05f;
  };
  maps.push_back(make("smooth", size, lamps));
  maps.push_back(make("soft shadow", size, [&](float x, float y, float* t) {
    lamps(x, y, t);
    const float s = 0.05f + 0.95f * step((std::fmod(x + 0.4f * y, 80.0f) - 30) / 14);
    for (int c = 0; c < 3; ++c) t[c] = t[c] * s + 0.01f * static_cast<float>(c + 1);
  }));
  maps.push_back(make("hard edge 100:1", size, [&](float x, float y, float* t) {
    const bool lit = std::fmod(0.9f * x + 0.37f * y, 23.0f) < 11;
    const float e = 1 + 0.2f * step(std::fmod(y, 64.0f) / 64);
    t[0] = lit ? 8 * e : 0.08f * e;
    t[1] = lit ? 7 * e : 0.085f * e;
    t[2] = lit ? 5 * e : 0.1f * e;
  }));
  maps.push_back(make("coloured bounce, noise", size, [&](float x, float y, float* t) {
    const float a = step(std::fmod(x, 90.0f) / 90), b = step(std::fmod(y, 70.0f) / 70);
    const auto n = [&](uint32_t k) {
      return 0.97f + 0.06f * noise(static_cast<uint32_t>(x), static_cast<uint32_t>(y), k);
    };
    t[0] = (0.3f + 1.2f * a) * n(1);
    t[1] = (0.3f + 0.4f * b) * n(2);
    t[2] = (0.9f - 0.6f * a * b) * n(3);
  }));
  return maps;
}

struct Row {
  double log_squares = 0, rel_squares = 0, values = 0, of_range = 0, of_largest = 0;
  double peak = 0;
};

// Errors of texels with weight; those of a block against the range of its channels and its largest value.
Row compare(const Map& map, const std::vector<float>& decoded) {
  Row row;
  for (uint32_t by = 0; by < map.size; by += 4)
    for (uint32_t bx = 0; bx < map.size; bx += 4) {
      double low = 1e30, high = -1e30, worst = 0;
      for (uint32_t i = 0; i < 16; ++i) {
        const size_t x = bx + i % 4, y = by + i / 4;
        if (x >= map.size || y >= map.size || !(map.weight[y * map.size + x] > 0)) continue;
        for (size_t c = 0; c < 3; ++c) {
          const double a = map.rgba[4 * (y * map.size + x) + c], b = decoded[4 * (y * map.size + x) + c];
          low = std::min(low, a);
          high = std::max(high, a);
          worst = std::max(worst, std::abs(b - a));
          const double logs = std::log2(std::max(b, 1e-6)) - std::log2(std::max(a, 1e-6));
          row.log_squares += logs * logs;
          row.rel_squares += (b - a) * (b - a) / (a * a + 1e-6);
          row.values += 1;
        }
      }
      if (high <= 0) continue;
      row.of_range = std::max(row.of_range, worst / (high - low));
      row.of_largest = std::max(row.of_largest, worst / high);
    }
  return row;
}

int run(int argc, char** argv) {
  uint32_t size = 512;
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--size") && i + 1 < argc)
      size = static_cast<uint32_t>(std::atoi(argv[++i]));
    else
      names.push_back(argv[i]);
  }
  std::printf(
      "| format | map | effort | RMSE log2 | relMSE | worst / range | worst / largest | Mtexel/s |\n");
  for (const BlockFormat& format : block_formats()) {
    if (!names.empty() && std::find(names.begin(), names.end(), format.name) == names.end()) continue;
    for (const Map& map : synthetic(size))
      for (int effort = 0; effort < 3; ++effort)
        for (const bool fill : {true, false}) {
          const auto begin = std::chrono::steady_clock::now();
          const auto blocks = encode_blocks(format, {size, size, map.rgba, map.weight},
                                            {BlockEffort(effort), BlockMetric::kLog}, fill, 1);
          const double seconds =
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
          const Row row = compare(map, *decode_blocks(format, *blocks, size, size, 1));
          std::printf("| %s | %s | %d%s | %.5f | %.2e | %.2f %% | %.2f %% | %.2f |\n",
                      std::string(format.name).c_str(), map.name.c_str(), effort, fill ? "" : " no fill",
                      std::sqrt(row.log_squares / row.values), row.rel_squares / row.values,
                      100 * row.of_range, 100 * row.of_largest, size * size / seconds / 1e6);
          std::fflush(stdout);
        }
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
