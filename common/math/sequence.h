// Random numbers keyed by (job seed, texel, sample index, dimension); nothing else enters.
//
// Owen-scrambled Sobol' (0,2)-pairs, padded: every pair of dimensions uses the first two Sobol'
// dimensions with its own scrambles and its own order of points.
// Burley 2020, Practical Hash-based Owen Scrambling, JCGT 10(4), sections 3 and 4.
// Departure: the second Sobol' dimension is the Pascal matrix modulo 2, applied in five shift-and-xor
// steps (it is the fifth Kronecker power of [1 1; 0 1]) instead of 32 table rows.
// Other samplers (--sampler) are kept out of line in samplers.cpp.
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

// Second Sobol' dimension of point `index`, before its bits are reversed.
constexpr uint32_t pascal_mod2(uint32_t x) {
  x ^= (x & 0xaaaaaaaau) >> 1;
  x ^= (x & 0xccccccccu) >> 2;
  x ^= (x & 0xf0f0f0f0u) >> 4;
  x ^= (x & 0xff00ff00u) >> 8;
  x ^= (x & 0xffff0000u) >> 16;
  return x;
}

// 32 bits to (0, 1) in float: the middle of one of 2^23 equal cells. Never returns 0 or 1: at 10^7 samples a
// second either would occur, and a warp may divide by it.
constexpr float unit_float(uint32_t bits) {
  return (static_cast<float>(bits >> 9) + 0.5f) * 0x1p-23f;
}

// A bijection of 64 bits: the finaliser of SplitMix64 (Steele, Lea & Flood 2014, variant 13 of Stafford).
constexpr uint64_t mix_bits(uint64_t x) {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

// A unit_float with 30 more bits, from the low half of `key`; in [0, 1). For discrete choices too fine for 23
// bits.
constexpr double refined(float u, uint64_t key) {
  const double fraction = static_cast<double>(key >> 2 & 0x3fffffff) * 0x1p-30;
  const double fine = static_cast<double>(u) + (fraction - 0.5) * 0x1p-23;
  return fine < 0.0 ? 0.0 : fine < 1.0 ? fine : 0x1.fffffffffffffp-1;
}

// The job's seed in one of the independent randomisations of every sequence.
constexpr uint64_t sequence_seed(uint64_t job_seed, uint64_t randomisation) {
  return randomisation ? mix_bits(job_seed + randomisation * 0x9e3779b97f4a7c15u) : job_seed;
}

// Both halves reversed in one go.
constexpr uint64_t reverse_halves(uint64_t x) {
  x = __builtin_bswap64(x);
  x = (x >> 4 & 0x0f0f0f0f0f0f0f0fu) | (x & 0x0f0f0f0f0f0f0f0fu) << 4;
  x = (x >> 2 & 0x3333333333333333u) | (x & 0x3333333333333333u) << 2;
  x = (x >> 1 & 0x5555555555555555u) | (x & 0x5555555555555555u) << 1;
  return x >> 32 | x << 32;
}

// Sources of sample points, in the order of the job's bytes and of sampler_names().
enum class Sampler : uint32_t { kOwen, kHalton, kPmj02, kRandom };
constexpr uint32_t kSamplers = 4;

// The stream of one sample of one texel. Callers request pairs by dimension number, so adding a strategy
// renumbers nothing: docs/maths.md has the allocation. Unused dimensions cost nothing.
class SampleStream {
 public:
  SampleStream() : SampleStream(0, 0, 0) {}
  SampleStream(uint64_t job_seed, uint32_t texel, uint32_t sample, Sampler sampler = Sampler::kOwen)
      : key_(mix_bits(mix_bits(job_seed) ^ texel)),
        sample_(sample),
        reversed_(reverse_bits(sample)),
        sampler_(sampler) {}

  // Two numbers in (0, 1), stratified over the samples of this texel (unless the sampler is kRandom).
  Vec2 pair(uint32_t dimension) const {
    if (sampler_ != Sampler::kOwen) [[unlikely]]
      return other_pair(dimension);
    const uint64_t seed = seed_of(dimension);
    const uint32_t index = shuffled(seed);
    const uint32_t x = laine_karras(index, first_scramble(seed));
    const uint32_t y = laine_karras(pascal_mod2(index), second_scramble(seed));
    const uint64_t both = reverse_halves(uint64_t{x} << 32 | y);
    return {unit_float(static_cast<uint32_t>(both >> 32)), unit_float(static_cast<uint32_t>(both))};
  }
  // The first number of the pair.
  float single(uint32_t dimension) const {
    if (sampler_ != Sampler::kOwen) [[unlikely]]
      return other_pair(dimension).x;
    const uint64_t seed = seed_of(dimension);
    return unit_float(reverse_bits(laine_karras(shuffled(seed), first_scramble(seed))));
  }
  // 32 bits that share no structure between samples; for stochastic transparency.
  uint32_t bits(uint32_t dimension) const {
    return static_cast<uint32_t>(mix_bits(key_ ^ (uint64_t{sample_} << 32 | dimension)) >> 32);
  }

 private:
  // One mixed word a dimension: its halves scramble the order of points and the first number, the high half
  // of an odd multiple the second.
  uint64_t seed_of(uint32_t dimension) const {
    return mix_bits(key_ + (dimension + 1) * 0x9e3779b97f4a7c15u);
  }
  uint32_t shuffled(uint64_t seed) const {
    return reverse_bits(laine_karras(reversed_, static_cast<uint32_t>(seed)));
  }
  static uint32_t first_scramble(uint64_t seed) { return static_cast<uint32_t>(seed >> 32); }
  static uint32_t second_scramble(uint64_t seed) {
    return static_cast<uint32_t>(seed * 0xd1342543de82ef95u >> 32);
  }

  friend class SampleBatch;
  Vec2 other_pair(uint32_t dimension) const;  // for samplers other than the default

  uint64_t key_;
  uint32_t sample_, reversed_;
  Sampler sampler_;
};

}  // namespace kiln
