// ROOM: add a basis. A basis is a set of scalar functions of direction; a texel accumulates the moments
//   M_i = integral over incident directions of radiance(d) * f_i(d) dw        (per colour channel)
// which add over samples, chunks and machines; f may also depend on the surface's normal. What is stored are
// the moments' means, to which finish() is applied once: after merging, denoising and joining, where their
// sums are of no more use. After that everything is named planes and nobody asks which basis they came from.
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
  bool has_direction = false;
  std::string_view about;
  std::string_view convention{};  // how E follows from the functions; empty: they are none
  // How the functions were chosen: "project" or "cap"; which evaluation of E they are for: "linear" or
  // "hazel".
  std::string_view fit{}, evaluator{};
  // Prefix of the names of bands: "L" for L0, L1, ...; the name itself where all functions are of one degree.
  std::string_view band = "L";
  std::span<const Vec3> axes{};  // of lobes, one for each function; empty: harmonics
  bool is_local = false;  // functions are in the ReceiverFrame of the shading normal; else in world axes
  bool has_base = true;   // function 0 is a light that the others may be ratios of, between -1 and 1
  // E of one colour at a unit normal m from its functions, as engines evaluate it, on a surface of shading
  // normal n; null without functions.
  float (*irradiance)(const float* f, const Vec3& n, const Vec3& m) = nullptr;
  // The means of moments already obey the bound of has_direction; else only what finish() returns does.
  bool is_bounded = true;
  // Turns one colour's moments into what is stored, given E at the unit normal n: irradiance(f, n, n) is e
  // afterwards to 2e-5 of e, rounding. Null: moments are stored.
  void (*finish)(float e, const Vec3& n, float* f) = nullptr;
};

constexpr int kMaxBasisFunctions = 12;

// Only E at the surface normal, which every bake has: no additional functions.
struct IrradianceOnly {
  static constexpr std::array<std::string_view, 0> functions{};
  static constexpr std::array<bool, 0> is_signed{};
  static constexpr std::array<uint32_t, 0> degree{};
  static BasisInfo info() {
    return {"irradiance", functions, is_signed, degree, false, "E at the surface normal alone"};
  }
  static void evaluate(const Vec3&, const Vec3&, float*) {}
};

// RGB L1 spherical harmonics in the convention of O'Donnell 2018 (Precomputed Global Illumination in
// Frostbite, "Lightmap encoding"): L0 = 1/(4 pi) int L dw, L1 = 1/(4 pi) int L d dw, world axes, so that
// E(n)/pi = L0 + 2 L1.n.
struct ShL1 {
  static constexpr std::array<std::string_view, 4> functions{"L0", "L1x", "L1y", "L1z"};
  static constexpr std::array<bool, 4> is_signed{false, true, true, true};
  static constexpr std::array<uint32_t, 4> degree{0, 1, 1, 1};
  static BasisInfo info() {
    BasisInfo b{"sh_l1", functions, is_signed,
                degree,  true,      "RGB L1 spherical harmonics of radiance, world axes"};
    b.convention = "L0 = 1/(4 pi) integral L dw, L1 = 1/(4 pi) integral L d dw; E(n)/pi = L0 + 2 L1.n";
    b.fit = "project";
    b.evaluator = "linear";
    b.irradiance = [](const float* f, const Vec3&, const Vec3& m) { return irradiance(f, m); };
    return b;
  }
  static float irradiance(const float* f, const Vec3& n) {
    return kPi * (f[0] + 2.0f * (f[1] * n.x + f[2] * n.y + f[3] * n.z));
  }
  static void evaluate(const Vec3& d, const Vec3&, float* f) {
    constexpr float k = 0.25f * kInvPi;
    f[0] = k;
    f[1] = k * d.x;
    f[2] = k * d.y;
    f[3] = k * d.z;
  }
};

// Linear reconstruction of E(n) from one channel of L0 and L1, in the unit of E. May be negative (ringing).
inline float sh_l1_irradiance(float l0, const Vec3& l1, const Vec3& n) {
  const float f[4] = {l0, l1.x, l1.y, l1.z};
  return ShL1::irradiance(f, n);
}

// Functions of the same degree: "L0", "L1".
struct BasisBand {
  std::string name;
  std::vector<size_t> functions;
};
std::vector<BasisBand> basis_bands(const BasisInfo& basis);
// The most irradiance that 1 of that function gives a normal, over those of a surface: pi for L0, 2 pi for an
// L1.
double largest_irradiance(const BasisInfo& basis, size_t function);

// Roster: every basis, in the order of --help.
std::span<const BasisInfo> basis_roster();
// Index into the roster, or an error that lists the names. `fit`: "cap" finds every basis' own fit to E.
// Bases without fits or evaluators ignore these.
Expected<uint32_t> find_basis(std::string_view name, std::string_view fit = "project",
                              std::string_view evaluator = "linear");
// f_i of basis `index` for light from a unit direction at a surface of unit normal, into f[0 ..
// functions.size()).
void evaluate_basis(uint32_t index, const Vec3& direction, const Vec3& normal, float* f);

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
