// ROOM: add a basis. A basis is a set of scalar functions of direction; a texel accumulates the moments
//   M_i = integral over incident directions of radiance(d) * f_i(d) dw        (per colour channel)
// which add over samples, chunks and machines. What is stored is a linear function of them, solved once
// at resolve. After that there are only named planes, whatever the basis.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"

namespace kiln {

// A roster entry: the number of functions, the names of their planes and whether a plane is signed.
struct BasisInfo {
  std::string_view name;
  std::span<const std::string_view> functions;  // plane prefixes: "L0", "L1x", ...
  std::span<const bool> is_signed;
  std::span<const uint32_t> degree;  // of each function; functions of one degree form a band
  // Function 0 bounds the length of the vector of functions 1, 2 and 3, in each colour channel.
  bool has_direction;
  std::string_view about;
  std::string_view convention{};  // how E follows from the functions; empty without functions
};

constexpr int kMaxBasisFunctions = 4;

// Only E at the surface normal, which every bake has: no additional functions.
struct IrradianceOnly {
  static constexpr std::array<std::string_view, 0> functions{};
  static constexpr std::array<bool, 0> is_signed{};
  static constexpr std::array<uint32_t, 0> degree{};
  static BasisInfo info() {
    return {"irradiance", functions, is_signed, degree, false, "E at the surface normal alone"};
  }
  static void evaluate(const Vec3&, float*) {}
};

// RGB L1 spherical harmonics in the convention of O'Donnell 2018 (Precomputed Global Illumination in
// Frostbite, "Lightmap encoding"): L0 = 1/(4 pi) int L dw, L1 = 1/(4 pi) int L d dw, world axes, so that
// E(n)/pi = L0 + 2 L1.n.
struct ShL1 {
  static constexpr std::array<std::string_view, 4> functions{"L0", "L1x", "L1y", "L1z"};
  static constexpr std::array<bool, 4> is_signed{false, true, true, true};
  static constexpr std::array<uint32_t, 4> degree{0, 1, 1, 1};
  static BasisInfo info() {
    return {"sh_l1",
            functions,
            is_signed,
            degree,
            true,
            "RGB L1 spherical harmonics of radiance, world axes",
            "L0 = 1/(4 pi) integral L dw, L1 = 1/(4 pi) integral L d dw; E(n)/pi = L0 + 2 L1.n"};
  }
  static void evaluate(const Vec3& d, float* f) {
    constexpr float k = 0.25f * kInvPi;
    f[0] = k;
    f[1] = k * d.x;
    f[2] = k * d.y;
    f[3] = k * d.z;
  }
};

// Linear reconstruction of E(n) from one channel of L0 and L1, in the unit of E. May be negative (ringing).
inline float sh_l1_irradiance(float l0, const Vec3& l1, const Vec3& n) {
  return kPi * (l0 + 2.0f * dot(l1, n));
}

// Functions of the same degree: "L0", "L1".
struct BasisBand {
  std::string name;
  std::vector<size_t> functions;
};
std::vector<BasisBand> basis_bands(const BasisInfo& basis);

// Roster: every basis, in the order of --help.
std::span<const BasisInfo> basis_roster();
// Index into the roster, or an error that lists the names.
Expected<uint32_t> find_basis(std::string_view name);
// f_i(d) of basis `index`, into f[0 .. functions.size()).
void evaluate_basis(uint32_t index, const Vec3& direction, float* f);

// Planes of a moment record (MomentLayout); without light, those from kMomentER on are absent.
enum MomentPlane : uint32_t {
  kMomentInside,  // primary rays that met a back face
  kMomentPushed,  // samples taken from a place moved out of geometry
  kMomentER,      // radiance x cosine / pdf at the surface normal
  kMomentEG,
  kMomentEB,
  kMomentLum,   // luminance of the E sample
  kMomentLum2,  // its square
  kMomentBasis,
};

}  // namespace kiln
