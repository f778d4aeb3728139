#include "coordinator/output/blocks/bc5.h"

#include "coordinator/output/blocks/bc4_channel.h"

namespace kiln {
namespace {

void encode(const BlockTexels& texels, bool is_signed, BlockEffort effort, uint8_t* block) {
  for (int c = 0; c < 2; ++c) encode_channel(texels, c, is_signed, effort, block + 8 * c);
}

void decode(const uint8_t* block, bool is_signed, BlockTexels& texels) {
  for (auto& texel : texels.rgba) texel[2] = 0, texel[3] = 1;
  for (int c = 0; c < 2; ++c) decode_channel(block + 8 * c, is_signed, c, texels);
}

}  // namespace

void encode_bc5(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode(texels, false, choice.effort, block);
}

void encode_bc5_snorm(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode(texels, true, choice.effort, block);
}

void decode_bc5(const uint8_t* block, BlockTexels& texels) {
  decode(block, false, texels);
}

void decode_bc5_snorm(const uint8_t* block, BlockTexels& texels) {
  decode(block, true, texels);
}

}  // namespace kiln
