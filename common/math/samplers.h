// The samplers that are not the default, one function each; and the names of all.
#pragma once

#include <span>
#include <string_view>

#include "common/base/status.h"
#include "common/math/sequence.h"

namespace kiln {

// In the order of Sampler.
std::span<const std::string_view> sampler_names();
// The sampler of that name, or an error that lists the names.
Expected<Sampler> find_sampler(std::string_view name);

// Radical inverse of `index` in `base` (at least 2) as a fraction of 2^32, rounded down.
uint32_t radical_inverse(uint32_t index, uint32_t base);

// The table of the sampler pmj02: `size` points of the unit square, in fractions of 2^32. Every aligned run
// of 2^m points, whatever m, is a (0, m, 2)-net in base 2. Built on first use.
struct Pmj02Table {
  static constexpr uint32_t kLog2Size = 12, kSize = 1u << kLog2Size;
  uint32_t x[kSize], y[kSize];
};
const Pmj02Table& pmj02_table();

}  // namespace kiln
