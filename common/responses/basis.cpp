#include "common/responses/basis.h"

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/responses/basis_roster.h"
#include "common/responses/h_basis.h"
#include "common/responses/lobes.h"
#include "common/responses/sh_l1_fit.h"
#include "common/responses/sh_l2.h"

namespace kiln {
namespace {

// One word to add a basis, at the end: units name it by its index.
using Bases = BasisRoster<IrradianceOnly, ShL1, ShL1Cap, ShL1Hazel, ShL2, ShL2Cap, HBasis, HBasisCap,
                          Ad9<LobeFit::kProject>, Ad9<LobeFit::kExact>, Ad9<LobeFit::kPositive>,
                          Ad12<LobeFit::kProject>, Ad12<LobeFit::kExact>, Ad12<LobeFit::kPositive>,
                          Sg9<LobeFit::kProject>, Sg9<LobeFit::kExact>, Sg9<LobeFit::kPositive>,
                          Sg12<LobeFit::kProject>, Sg12<LobeFit::kExact>, Sg12<LobeFit::kPositive>>;

}  // namespace

std::span<const BasisInfo> basis_roster() {
  return Bases::all();
}

std::vector<BasisBand> basis_bands(const BasisInfo& basis) {
  std::vector<BasisBand> bands;
  const bool is_one = basis.degree.empty() || basis.degree.front() == basis.degree.back();
  for (size_t f = 0; f < basis.functions.size(); ++f) {
    const std::string name = is_one ? std::string(basis.band) : text("{}{}", basis.band, basis.degree[f]);
    if (bands.empty() || bands.back().name != name) bands.push_back({name, {}});
    bands.back().functions.push_back(f);
  }
  return bands;
}

Expected<uint32_t> find_basis(std::string_view name, std::string_view fit, std::string_view evaluator) {
  std::string names;
  std::string_view last;
  bool is_known = false;
  for (uint32_t i = 0; i < basis_roster().size(); ++i) {
    const BasisInfo& b = basis_roster()[i];
    if (b.name != last) names += text("{}{}", i ? ", " : "", b.name);
    last = b.name;
    if (b.name != name) continue;
    is_known = true;
    // The projection has every evaluator; "cap" is every basis' own fit to E.
    const bool is_of_fit = b.fit == fit || (fit == "cap" && b.fit == "exact");
    if (b.fit.empty() || (is_of_fit && (fit == "project" || b.evaluator == evaluator))) return i;
  }
  if (is_known)
    return fail(
        ErrorKind::kUsage,
        text("the basis {} has no fit '{}' for the evaluator '{}': leave --sh-fit and --sh-evaluator out, or "
             "take another basis (docs/bases.md)",
             name, fit, evaluator));
  return fail(ErrorKind::kUsage, text("there is no basis '{}': choose one of {}", name, names));
}

double largest_irradiance(const BasisInfo& basis, size_t function) {
  KILN_CHECK(function < basis.functions.size());
  float f[kMaxBasisFunctions] = {};
  f[function] = 1;
  double largest = 0;
  const Vec3 up(0, 0, 1);
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = basis.is_local ? 0 : -1; z <= 1; ++z) {
        const Vec3 m(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        if (dot(m, m) > 0)
          largest = std::max(largest, std::abs(double{basis.irradiance(f, up, m / length(m))}));
      }
  return largest;
}

void evaluate_basis(uint32_t index, const Vec3& direction, const Vec3& normal, float* f) {
  Bases::evaluate(index, direction, normal, f);
}

}  // namespace kiln
