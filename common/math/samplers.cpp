#include "common/math/samplers.h"

#include <memory>

#include "common/base/format.h"

namespace kiln {
namespace {

// Halton 1960, each pair of dimensions with two primes of its own, shifted on the torus by two numbers of the
// texel (Cranley & Patterson 1976), as O'Donnell 2018 ("Hemisphere sampling"). Large bases correlate until
// there are as many samples as the product of two of them, and a shift does not help: so the sequence covers
// only the texel's own vertex, with the smallest primes where they matter most; further dimensions are
// random.
constexpr uint32_t kHaltonPairs = 8;
constexpr uint32_t kPrimes[kHaltonPairs][2] = {
    {5, 37},   // site in the texel
    {2, 3},    // direction
    {41, 43},  // layer choice: only glass reads it here
    {19, 47},  // choice of local light
    {7, 11},   // point on it
    {31, 53},  // choice of sun
    {23, 29},  // point on its disc
    {13, 17},  // environment
};

// Nested uniform scramble (Owen 1995) with a flip drawn for every digit prefix, exact where the hash of
// sequence.h is approximate. First digit in the top bit.
uint32_t nested_scramble(uint32_t digits, uint64_t seed) {
  uint32_t out = digits;
  for (uint32_t level = 0; level < 32; ++level) {
    const uint64_t prefix = level ? digits >> (32 - level) : 0;
    const auto flip =
        static_cast<uint32_t>(mix_bits(seed + (prefix << 8 | level) * 0x9e3779b97f4a7c15u) >> 63);
    out ^= flip << (31 - level);
  }
  return out;
}

// Progressive multi-jittered (0,2) points (Christensen, Kensler & Kilpatrick 2018, CGF 37(4), section 4), in
// the form of Helmer, Christensen & Kensler 2021: an Owen-scrambled Sobol' sequence. Reason: not the first
// 2^m points alone but every aligned run of 2^m is then a net, so that a scramble of the order, which pads
// the dimensions, keeps all prefixes nets. No best-candidate search: such a scramble undoes it.
std::unique_ptr<const Pmj02Table> make_pmj02_table() {
  auto table = std::make_unique<Pmj02Table>();
  for (uint32_t i = 0; i < Pmj02Table::kSize; ++i) {
    table->x[i] = nested_scramble(reverse_bits(i), mix_bits(1));
    table->y[i] = nested_scramble(reverse_bits(pascal_mod2(i)), mix_bits(2));
  }
  return table;
}

constexpr std::string_view kNames[kSamplers] = {"owen", "halton", "pmj02", "random"};

}  // namespace

std::span<const std::string_view> sampler_names() {
  return kNames;
}

Expected<Sampler> find_sampler(std::string_view name) {
  std::string names;
  for (uint32_t i = 0; i < kSamplers; ++i) {
    if (kNames[i] == name) return static_cast<Sampler>(i);
    names += text("{}{}", i ? ", " : "", kNames[i]);
  }
  return fail(ErrorKind::kUsage, text("there is no sampler '{}': choose one of {}", name, names));
}

uint32_t radical_inverse(uint32_t index, uint32_t base) {
  if (base == 2) return reverse_bits(index);
  uint64_t reversed = 0, power = 1;  // power <= index * base < 2^38
  for (; index; index /= base) {
    reversed = reversed * base + index % base;
    power *= base;
  }
  return static_cast<uint32_t>(static_cast<double>(reversed) / static_cast<double>(power) * 0x1p32);
}

const Pmj02Table& pmj02_table() {
  static const std::unique_ptr<const Pmj02Table> table = make_pmj02_table();
  return *table;
}

Vec2 SampleStream::other_pair(uint32_t dimension) const {
  uint64_t seed = seed_of(dimension);
  if (sampler_ == Sampler::kHalton && dimension < kHaltonPairs) {
    const uint32_t(&base)[2] = kPrimes[dimension];
    return {unit_float(radical_inverse(sample_, base[0]) + first_scramble(seed)),
            unit_float(radical_inverse(sample_, base[1]) + second_scramble(seed))};
  }
  if (sampler_ == Sampler::kPmj02) {
    // Every run of kSize samples, and every dimension, has its own order of the points and its own flips.
    const Pmj02Table& table = pmj02_table();
    seed = mix_bits(seed + (sample_ >> Pmj02Table::kLog2Size));
    const uint32_t i = shuffled(seed) & (Pmj02Table::kSize - 1);
    return {unit_float(table.x[i] ^ first_scramble(seed)), unit_float(table.y[i] ^ second_scramble(seed))};
  }
  const uint64_t drawn = mix_bits(seed + sample_ * 0xd1342543de82ef95u);
  return {unit_float(static_cast<uint32_t>(drawn >> 32)), unit_float(static_cast<uint32_t>(drawn))};
}

}  // namespace kiln
