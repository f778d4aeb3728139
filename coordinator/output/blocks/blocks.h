// ROOM: add a block format. Block-compressed texels, in and out: 4x4 texels become 8 or 16 bytes. A format is
// one pair of files and one line in the roster of blocks.cpp. Independent of files, pages and lightmaps.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// 4x4 texels, row by row from the top. BC6H: linear values (signed or not); BC1, BC4, BC5 and BC7: [0, 1];
// BC4 and BC5 with sign: [-1, 1].
struct BlockTexels {
  float rgba[16][4];
  float weight[16];  // of the texel's error; 0: unused texel, any value will do
};

enum class BlockEffort : uint8_t { kFast, kNormal, kBest };

// The error that the encoder minimises.
//   kLinear      squares of differences
//   kLog         squares of differences of logarithms, channel by channel (BC6H: of half floats' bits, which
//                are a logarithm within 6 %)
//   kPerceptual  squares of differences relative to the texel's luminance, weighted as luminance and chroma
enum class BlockMetric : uint8_t { kLinear, kLog, kPerceptual };

struct BlockChoice {
  BlockEffort effort = BlockEffort::kNormal;
  BlockMetric metric = BlockMetric::kLog;
  bool alpha = false;  // BC7: encode the fourth channel; else it decodes as 1
};

struct BlockFormat {
  std::string_view name;  // "bc6h_ufloat"
  uint32_t bytes;         // of a block: 8 or 16
  uint32_t channels;      // coded, from red on; others decode as 0, alpha as 1
  // Values are finite and within the format's range (encode_blocks ensures it). Deterministic: the same bytes
  // on any machine and for any instruction set.
  void (*encode)(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
  // Any bytes are a valid block; reserved ones decode as the specification requires. Does not write weights.
  void (*decode)(const uint8_t* block, BlockTexels& texels);
  float lowest, highest;  // representable
};

std::span<const BlockFormat> block_formats();
const BlockFormat* find_block_format(std::string_view name);  // null: there is none

// An image: row 0 on top.
struct BlockImage {
  uint32_t width = 0,
           height = 0;  // any; blocks at the right and lower border are padded with texels of weight 0
  std::span<const float> rgba;    // 4 floats a texel
  std::span<const float> weight;  // by texel; empty: 1
};

// Sets texels without weight to the weighted mean of the others in the block before encoding (O'Donnell 2018,
// block-aware fill), so that it does not stretch the end points. Blocks without any weight become 0.
void fill_block(BlockTexels& texels);

uint64_t blocks_bytes(const BlockFormat& format, uint32_t width, uint32_t height);

// Blocks row by row. `fill` off: texels without weight are encoded like the others (to measure the benefit of
// the fill). Errors (kInvalidInput): a non-finite texel with weight, by its position. Values beyond the
// format's range are clamped.
Expected<Bytes> encode_blocks(const BlockFormat& format, const BlockImage& image, const BlockChoice& choice,
                              bool fill = true, unsigned threads = 0);

// 4 floats a texel. Errors (kInvalidInput): too few bytes.
Expected<std::vector<float>> decode_blocks(const BlockFormat& format, std::span<const std::byte> blocks,
                                           uint32_t width, uint32_t height, unsigned threads = 0);

}  // namespace kiln
