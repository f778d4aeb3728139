// What code that loops over the bases needs from a list of them.
#pragma once

#include "common/responses/basis.h"

namespace kiln {

template <class... Basis>
struct BasisRoster {
  static std::span<const BasisInfo> all() {
    static const std::array<BasisInfo, sizeof...(Basis)> infos{Basis::info()...};
    static_assert(((Basis::functions.size() <= size_t{kMaxBasisFunctions}) && ...));
    return infos;
  }
  // f_i(d, n) of basis `index`, into f[0 .. functions.size()).
  static void evaluate(uint32_t index, const Vec3& d, const Vec3& n, float* f) {
    uint32_t i = 0;
    ((i++ == index ? Basis::evaluate(d, n, f) : void()), ...);
  }
};

}  // namespace kiln
