// Random numbers keyed by (job seed, texel, sample index, dimension); nothing else enters.
//
// Owen-scrambled Sobol' (0,2)-pairs, padded: every pair of dimensions uses the first two Sobol'
// dimensions with its own scrambles and its own order of points.
// Burley 2020, Practical Hash-based Owen Scrambling, JCGT 10(4), sections 3 and 4.
// Departure: the second Sobol' dimension is the Pascal matrix modulo 2, applied in five shift-and-xor
// steps (it is the fifth Kronecker power of [1 1; 0 1]) instead of 32 table rows.
#pragma once

#include <cstdint>

#include "common/math/vec.h"

namespace kiln {

constexpr uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
  x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
  return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}

// Murmur3's finaliser: a bijection of 32 bits.
constexpr uint32_t hash_bits(uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ x >> 16;
}
constexpr uint32_t hash_combine(uint32_t seed, uint32_t value) {
  return hash_bits(seed ^ (hash_bits(value) + 0x9e3779b9u + (seed << 6) + (seed >> 2)));
}

// A hash in which bit k of the result depends on bits 0..k of x only (Laine & Karras 2011, constants of
// Vegdahl 2021): applied to reversed bits it is a nested uniform (Owen) scramble.
constexpr uint32_t laine_karras(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}
constexpr uint32_t owen_scramble(uint32_t x, uint32_t seed) {
  return reverse_bits(laine_karras(reverse_bits(x), seed));
}

// Second Sobol' dimension of point `index`, before its bits are reversed.
constexpr uint32_t pascal_mod2(uint32_t x) {
  x ^= (x & 0xaaaaaaaau) >> 1;
  x ^= (x & 0xccccccccu) >> 2;
  x ^= (x & 0xf0f0f0f0u) >> 4;
  x ^= (x & 0xff00ff00u) >> 8;
  x ^= (x & 0xffff0000u) >> 16;
  return x;
}

// 32 bits to (0, 1) in float: the middle of one of 2^23 equal cells. Neither 0 nor 1 ever comes out: at
// 10^7 samples a second either would, and a warp may divide by it.
constexpr float unit_float(uint32_t bits) { return (static_cast<float>(bits >> 9) + 0.5f) * 0x1p-23f; }

// The stream of one sample of one texel. Dimensions are asked for in pairs by number, so that adding a
// strategy renumbers nothing else: see docs/maths.md for the allotment.
class SampleStream {
 public:
  SampleStream(uint64_t job_seed, uint32_t texel, uint32_t sample)
      : key_(hash_combine(hash_combine(static_cast<uint32_t>(job_seed), static_cast<uint32_t>(job_seed >> 32)),
                          texel)),
        sample_(sample) {}

  // Two numbers in (0, 1), stratified over the samples of this texel.
  Vec2 pair(uint32_t dimension) const {
    const uint32_t seed = hash_combine(key_, dimension);
    const uint32_t index = owen_scramble(sample_, seed);
    const uint32_t x = laine_karras(index, hash_bits(seed ^ 0x68bc21ebu));
    const uint32_t y = laine_karras(pascal_mod2(index), hash_bits(seed ^ 0x02e5be93u));
    return {unit_float(reverse_bits(x)), unit_float(reverse_bits(y))};
  }
  float single(uint32_t dimension) const {
    const uint32_t seed = hash_combine(key_, dimension);
    const uint32_t index = owen_scramble(sample_, seed);
    return unit_float(reverse_bits(laine_karras(index, hash_bits(seed ^ 0x68bc21ebu))));
  }
  // 32 bits that share no structure between samples; for stochastic transparency.
  uint32_t bits(uint32_t dimension) const { return hash_combine(hash_combine(key_, sample_), dimension); }

 private:
  uint32_t key_, sample_;
};

}  // namespace kiln
