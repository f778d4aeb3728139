#include "common/math/sequence_batch.h"

#include "common/base/wide.h"

namespace kiln {
namespace {

// As reverse_bits, with shifts only: there is no 32-bit byte swap for vectors before AVX2.
KILN_INLINE uint32_t reversed(uint32_t x) {
  x = x >> 16 | x << 16;
  x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
  x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
  x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
  return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}
// As unit_float: 23 bits fit a signed integer, which vector units can convert.
KILN_INLINE float unit(uint32_t bits) {
  return (static_cast<float>(static_cast<int32_t>(bits >> 9)) + 0.5f) * 0x1p-23f;
}
KILN_INLINE uint32_t scrambled(uint32_t x, uint32_t seed, uint32_t odd) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= odd;
  x ^= x * 0x05526c56u;
  return x ^ x * 0x53a22864u;
}

struct Seeds {
  uint32_t order, first, second;
};

// Eight samples at a time where the processor allows: integer operations and one exact conversion.
KILN_WIDE void owen_pairs(const uint32_t* __restrict sample, size_t count, Seeds s, float* __restrict x,
                          float* __restrict y) {
  const uint32_t odd[3] = {s.order >> 16 | 1, s.first >> 16 | 1, s.second >> 16 | 1};
  for (size_t k = 0; k < count; ++k) {
    const uint32_t index = reversed(scrambled(sample[k], s.order, odd[0]));
    uint32_t p = index;
    p ^= (p & 0xaaaaaaaau) >> 1;
    p ^= (p & 0xccccccccu) >> 2;
    p ^= (p & 0xf0f0f0f0u) >> 4;
    p ^= (p & 0xff00ff00u) >> 8;
    p ^= (p & 0xffff0000u) >> 16;
    x[k] = unit(reversed(scrambled(index, s.first, odd[1])));
    y[k] = unit(reversed(scrambled(p, s.second, odd[2])));
  }
}

KILN_WIDE void owen_singles(const uint32_t* __restrict sample, size_t count, Seeds s, float* __restrict x) {
  const uint32_t odd[2] = {s.order >> 16 | 1, s.first >> 16 | 1};
  for (size_t k = 0; k < count; ++k)
    x[k] = unit(reversed(scrambled(reversed(scrambled(sample[k], s.order, odd[0])), s.first, odd[1])));
}

}  // namespace

void SampleBatch::pairs(uint32_t dimension, const uint32_t* chosen, size_t count, float* x, float* y) const {
  if (!is_vectorised()) {
    for (size_t k = 0; k < count; ++k) {
      const Vec2 pair = stream(chosen[k]).pair(dimension);
      x[k] = pair.x, y[k] = pair.y;
    }
    return;
  }
  uint32_t samples[kMax];
  for (size_t k = 0; k < count; ++k) samples[k] = reversed_[chosen[k]];
  const uint64_t seed = stream_.seed_of(dimension);
  owen_pairs(
      samples, count,
      {static_cast<uint32_t>(seed), SampleStream::first_scramble(seed), SampleStream::second_scramble(seed)},
      x, y);
}

void SampleBatch::singles(uint32_t dimension, const uint32_t* chosen, size_t count, float* x) const {
  if (!is_vectorised()) {
    for (size_t k = 0; k < count; ++k) x[k] = stream(chosen[k]).single(dimension);
    return;
  }
  uint32_t samples[kMax];
  for (size_t k = 0; k < count; ++k) samples[k] = reversed_[chosen[k]];
  const uint64_t seed = stream_.seed_of(dimension);
  owen_singles(samples, count, {static_cast<uint32_t>(seed), SampleStream::first_scramble(seed), 0}, x);
}

SampleStream SampleBatch::stream(size_t i) const {
  SampleStream s = stream_;
  s.key_ = key_[i];
  s.reversed_ = reversed_[i];
  s.sample_ = reverse_bits(reversed_[i]);
  return s;
}

}  // namespace kiln
