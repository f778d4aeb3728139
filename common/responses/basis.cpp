#include "common/responses/basis.h"

#include "common/base/format.h"
#include "common/responses/basis_roster.h"
#include "common/responses/sh_l1_fit.h"

namespace kiln {
namespace {

using Bases = BasisRoster<IrradianceOnly, ShL1, ShL1Cap, ShL1Hazel>;  // one word to add a basis

}  // namespace

std::span<const BasisInfo> basis_roster() {
  return Bases::all();
}

std::vector<BasisBand> basis_bands(const BasisInfo& basis) {
  std::vector<BasisBand> bands;
  for (size_t f = 0; f < basis.functions.size(); ++f) {
    const std::string name = text("L{}", basis.degree[f]);
    if (bands.empty() || bands.back().name != name) bands.push_back({name, {}});
    bands.back().functions.push_back(f);
  }
  return bands;
}

Expected<uint32_t> find_basis(std::string_view name, std::string_view fit, std::string_view evaluator) {
  std::string names;
  std::string_view last;
  for (uint32_t i = 0; i < basis_roster().size(); ++i) {
    const BasisInfo& b = basis_roster()[i];
    const bool is_of_all = b.fit == "project" && fit == b.fit;  // the projection has every evaluator
    if (b.name == name && (b.fit.empty() || is_of_all || (b.fit == fit && b.evaluator == evaluator)))
      return i;
    if (b.name != last) names += text("{}{}", i ? ", " : "", b.name);
    last = b.name;
  }
  return fail(ErrorKind::kUsage, text("there is no basis '{}': choose one of {}", name, names));
}

void evaluate_basis(uint32_t index, const Vec3& direction, const Vec3& normal, float* f) {
  Bases::evaluate(index, direction, normal, f);
}

}  // namespace kiln
