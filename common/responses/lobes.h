// Bases of lobes of radiance: Ambient Dice (Iwanicki & Sloan 2017; the cosine lobes of Roughton 2019,
// Interactive Generation of Path-Traced Lightmaps, section 8.3) and spherical Gaussians (Pettineo & Neubelt
// 2015). They say irradiance at any normal, and reflections off rough surfaces (lobes_specular.h).
//
// Radiance is L(s) ~ sum b_i B_i(s) over the sphere, 0 below the surface's horizon: with the Gram matrix G_ij
// = int B_i B_j, b = G^-1 int B L. Each sample adds its own G^-1 B, which is linear, so units of any cut add
// up.
#pragma once

#include "common/responses/basis.h"

namespace kiln {

constexpr size_t kMaxLobes = 12;

// The lobes of one basis.
struct LobeSet {
  size_t count;
  bool is_local;  // axes in the ReceiverFrame of the normal; else in the world
  bool is_dice;   // cosine lobes; else Gaussians of sharpness kGaussianSharpness
  Vec3 axis[kMaxLobes];
  float inverse[kMaxLobes][kMaxLobes];  // of the Gram matrix
  double gram[kMaxLobes][kMaxLobes];
  double metric[kMaxLobes][kMaxLobes];  // of what finish() minimises
};

constexpr float kGaussianSharpness = 6.0f;

// B of a lobe at cosine c to its axis: .35 c^2 + .25 c^4 above 0, or exp(6 (c - 1)).
float lobe_radiance(const LobeSet& set, float c);
// Irradiance of a lobe / pi at a normal of cosine c to its axis, as engines evaluate it, > 0: Roughton's fit
// .05981 + .12918 c + .07056 c^2 (Eq. 8.14) for dice, within 0.0012 of the integral; Hill's for Gaussians
// (2016), within 0.0055.
float lobe_irradiance(const LobeSet& set, float c);

const LobeSet& ad9_lobes();
const LobeSet& ad12_lobes();
const LobeSet& sg9_lobes();
const LobeSet& sg12_lobes();

enum class LobeFit : uint8_t {
  kProject,   // the solution itself: of both signs
  kExact,     // the nearest that shows E at the shading normal, of both signs
  kPositive,  // the nearest that shows E and is not negative
};

// Entries of the roster.
template <const LobeSet& (*Set)(), size_t kCount, LobeFit kFit>
struct LobeBasis {
  static constexpr std::array<std::string_view, 12> names{"B0", "B1", "B2", "B3", "B4",  "B5",
                                                          "B6", "B7", "B8", "B9", "B10", "B11"};
  static constexpr std::array<bool, 12> signs = [] {
    std::array<bool, 12> out{};
    for (bool& is_signed : out) is_signed = kFit != LobeFit::kPositive;
    return out;
  }();
  static constexpr std::array<uint32_t, 12> degrees{};
  static constexpr std::span<const std::string_view> functions{names.data(), kCount};
  static constexpr std::span<const bool> is_signed{signs.data(), kCount};
  static constexpr std::span<const uint32_t> degree{degrees.data(), kCount};
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};
template <LobeFit kFit>
using Ad9 = LobeBasis<ad9_lobes, 9, kFit>;
template <LobeFit kFit>
using Ad12 = LobeBasis<ad12_lobes, 12, kFit>;
template <LobeFit kFit>
using Sg9 = LobeBasis<sg9_lobes, 9, kFit>;
template <LobeFit kFit>
using Sg12 = LobeBasis<sg12_lobes, 12, kFit>;

// E at unit normal m of a surface of shading normal n; f: one colour.
float lobes_irradiance(const LobeSet& set, const float* f, const Vec3& n, const Vec3& m);

// The b >= 0 with sum b_i weight_i = e nearest to `b` in the norm of `metric` (weights > 0, e >= 0); in
// place.
void nearest_not_negative(const LobeSet& set, const double* weight, double e, double* b);

}  // namespace kiln
