#include "common/responses/basis.h"

#include "common/base/format.h"
#include "common/responses/basis_roster.h"

namespace kiln {
namespace {

using Bases = BasisRoster<IrradianceOnly, ShL1>;  // add a basis here

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

Expected<uint32_t> find_basis(std::string_view name) {
  std::string names;
  for (uint32_t i = 0; i < basis_roster().size(); ++i) {
    if (basis_roster()[i].name == name) return i;
    names += text("{}{}", i ? ", " : "", basis_roster()[i].name);
  }
  return fail(ErrorKind::kUsage, text("there is no basis '{}': choose one of {}", name, names));
}

void evaluate_basis(uint32_t index, const Vec3& direction, float* f) {
  Bases::evaluate(index, direction, f);
}

}  // namespace kiln
