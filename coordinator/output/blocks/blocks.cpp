#include "coordinator/output/blocks/blocks.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/output/blocks/bc1.h"
#include "coordinator/output/blocks/bc4.h"
#include "coordinator/output/blocks/bc5.h"
#include "coordinator/output/blocks/bc6h.h"
#include "coordinator/output/blocks/bc7.h"

namespace kiln {
namespace {

// Texels of block (bx, by), with weight 0 outside the image.
void load(const BlockImage& image, uint32_t bx, uint32_t by, BlockTexels& t) {
  for (uint32_t i = 0; i < 16; ++i) {
    const uint32_t x = 4 * bx + i % 4, y = 4 * by + i / 4;
    if (x >= image.width || y >= image.height) {
      std::fill_n(t.rgba[i], 4, 0.0f);
      t.weight[i] = 0;
      continue;
    }
    const size_t texel = size_t{y} * image.width + x;
    std::copy_n(&image.rgba[4 * texel], 4, t.rgba[i]);
    t.weight[i] = image.weight.empty() ? 1.0f : image.weight[texel];
  }
}

constexpr uint64_t kNone = ~uint64_t{0};

}  // namespace

std::span<const BlockFormat> block_formats() {
  static const std::vector<BlockFormat> kFormats = {
      {"bc1", 8, 3, encode_bc1, decode_bc1, 0, 1},
      {"bc4", 8, 1, encode_bc4, decode_bc4, 0, 1},
      {"bc4_snorm", 8, 1, encode_bc4_snorm, decode_bc4_snorm, -1, 1},
      {"bc5", 16, 2, encode_bc5, decode_bc5, 0, 1},
      {"bc5_snorm", 16, 2, encode_bc5_snorm, decode_bc5_snorm, -1, 1},
      {"bc7", 16, 4, encode_bc7, decode_bc7, 0, 1},
      {"bc6h_ufloat", 16, 3, encode_bc6h_ufloat, decode_bc6h_ufloat, 0, kLargestHalf},
      {"bc6h_sfloat", 16, 3, encode_bc6h_sfloat, decode_bc6h_sfloat, -kLargestHalf, kLargestHalf},
  };
  return kFormats;
}

const BlockFormat* find_block_format(std::string_view name) {
  for (const BlockFormat& format : block_formats())
    if (format.name == name) return &format;
  return nullptr;
}

void fill_block(BlockTexels& t) {
  double sum[4] = {}, weight = 0;
  for (int i = 0; i < 16; ++i) {
    if (!(t.weight[i] > 0)) continue;
    weight += t.weight[i];
    for (int c = 0; c < 4; ++c) sum[c] += double{t.weight[i]} * t.rgba[i][c];
  }
  for (int i = 0; i < 16; ++i)
    if (!(t.weight[i] > 0))
      for (int c = 0; c < 4; ++c) t.rgba[i][c] = weight > 0 ? static_cast<float>(sum[c] / weight) : 0.0f;
}

uint64_t blocks_bytes(const BlockFormat& format, uint32_t width, uint32_t height) {
  return uint64_t{(width + 3) / 4} * ((height + 3) / 4) * format.bytes;
}

Expected<Bytes> encode_blocks(const BlockFormat& format, const BlockImage& image, const BlockChoice& choice,
                              bool fill, unsigned threads) {
  const uint32_t across = (image.width + 3) / 4, down = (image.height + 3) / 4;
  Bytes out(blocks_bytes(format, image.width, image.height), std::byte{0});
  std::atomic<uint64_t> wrong{kNone};
  parallel_for(
      down,
      [&](size_t by) {
        BlockTexels t;
        for (uint32_t bx = 0; bx < across; ++bx) {
          load(image, bx, static_cast<uint32_t>(by), t);
          for (uint32_t i = 0; i < 16; ++i) {
            for (int c = 0; c < 4; ++c) {
              if (std::isfinite(t.rgba[i][c])) continue;
              if (t.weight[i] > 0) {
                const uint64_t texel = (4 * by + i / 4) * image.width + 4 * bx + i % 4;
                uint64_t first = wrong;
                while (texel < first && !wrong.compare_exchange_weak(first, texel)) {
                }
              }
              t.rgba[i][c] = 0;
            }
          }
          if (fill)
            fill_block(t);
          else
            std::fill_n(t.weight, 16, 1.0f);
          for (auto& texel : t.rgba)
            for (float& v : texel) v = std::clamp(v, format.lowest, format.highest);
          format.encode(t, choice, reinterpret_cast<uint8_t*>(&out[(by * across + bx) * format.bytes]));
        }
      },
      threads);
  if (wrong != kNone)
    return fail(ErrorKind::kInvalidInput, text("texel {}, {} is not finite and cannot be compressed",
                                               wrong % image.width, wrong / image.width));
  return out;
}

Expected<std::vector<float>> decode_blocks(const BlockFormat& format, std::span<const std::byte> blocks,
                                           uint32_t width, uint32_t height, unsigned threads) {
  if (blocks.size() < blocks_bytes(format, width, height))
    return fail(ErrorKind::kInvalidInput,
                text("{} bytes are too few for {}x{} texels of {}: it takes {}", blocks.size(), width, height,
                     format.name, blocks_bytes(format, width, height)));
  const uint32_t across = (width + 3) / 4, down = (height + 3) / 4;
  std::vector<float> out(4 * size_t{width} * height);
  parallel_for(
      down,
      [&](size_t by) {
        BlockTexels t;
        for (uint32_t bx = 0; bx < across; ++bx) {
          format.decode(reinterpret_cast<const uint8_t*>(&blocks[(by * across + bx) * format.bytes]), t);
          for (uint32_t i = 0; i < 16; ++i) {
            const size_t x = 4 * size_t{bx} + i % 4, y = 4 * by + i / 4;
            if (x < width && y < height) std::copy_n(t.rgba[i], 4, &out[4 * (y * width + x)]);
          }
        }
      },
      threads);
  return out;
}

}  // namespace kiln
