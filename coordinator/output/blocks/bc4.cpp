#include "coordinator/output/blocks/bc4.h"

#include "coordinator/output/blocks/bc4_channel.h"

namespace kiln {
namespace {

void decode(const uint8_t* block, bool is_signed, BlockTexels& texels) {
  for (auto& texel : texels.rgba) texel[1] = texel[2] = 0, texel[3] = 1;
  decode_channel(block, is_signed, 0, texels);
}

}  // namespace

void encode_bc4(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode_channel(texels, 0, false, choice.effort, block);
}

void encode_bc4_snorm(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode_channel(texels, 0, true, choice.effort, block);
}

void decode_bc4(const uint8_t* block, BlockTexels& texels) {
  decode(block, false, texels);
}

void decode_bc4_snorm(const uint8_t* block, BlockTexels& texels) {
  decode(block, true, texels);
}

}  // namespace kiln
