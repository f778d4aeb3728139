#include "worker/lights/light_tree.h"

#include <bit>
#include <cstring>

#include "common/base/wide.h"
#include "common/math/sequence.h"

namespace kiln {
namespace {

// A light is culled only if its cosine is this far beyond a bound: more than rounding error.
constexpr float kSlack = 1e-5f;
// Weight of light along the surface relative to light along the normal. Moments other than
// irradiance have no cosine; this bounds the effect of the choice on their weights.
constexpr float kGrazing = 0.2f;
constexpr float kMinCosine = 1e-3f;

template <class Lanes>
KILN_INLINE Lanes at_least(const Lanes& a, float b) {
  return a > b ? a : Lanes{} + b;
}
template <class Lanes>
KILN_INLINE Lanes root(const Lanes& a) {
  Lanes out;
  for (size_t i = 0; i < sizeof(Lanes) / sizeof(float); ++i) out[i] = std::sqrt(a[i]);
  return out;
}

uint64_t key_of(float u, const Vec3& p) {
  return mix_bits(uint64_t{std::bit_cast<uint32_t>(u)} << 32 ^
                  uint64_t{std::bit_cast<uint32_t>(p.x)} * 0x9e3779b97f4a7c15u ^
                  uint64_t{std::bit_cast<uint32_t>(p.y)} * 0xd1342543de82ef95u ^
                  std::rotl(uint64_t{std::bit_cast<uint32_t>(p.z)}, 17));
}

// Mean of max(0, x) for x uniform in [c - half, c + half].
template <class Lanes>
KILN_INLINE Lanes mean_cosine(const Lanes& c, const Lanes& half) {
  const Lanes above = at_least(c + half, 0.0f);
  return c > half ? c : above * above / (4.0f * half);
}

}  // namespace

// Bounds of section 4 and importance of section 5.1: strength cos(theta') cos(theta_i') / d^2, with
// the smallest angles that the bounds allow. Departure: d^2 is the mean over the lights (squared
// distance to the centroid plus variance) instead of the clamped distance to the centre.
KILN_INLINE void LightTree::importance(const Group& a, const Vec3& p, const Vec3& n, Lanes& out) {
  const Lanes zero = {}, one = zero + 1.0f;
  const Lanes dx = p.x - a.x, dy = p.y - a.y, dz = p.z - a.z;
  const Lanes d2 = dx * dx + dy * dy + dz * dz, r2 = a.radius * a.radius;
  const Lanes inverse = 1.0f / root(at_least(d2, 1e-36f));
  const Lanes along = (a.axis_x * dx + a.axis_y * dy + a.axis_z * dz) * inverse;
  const Lanes folded = -a.fold * along;
  const Lanes cos_w = along > folded ? along : folded;
  const Lanes sin_w = root(at_least(1.0f - cos_w * cos_w, 0.0f));
  const Lanes cos_i = (n.x * dx + n.y * dy + n.z * dz) * -inverse;
  const Lanes sin_i = root(at_least(1.0f - cos_i * cos_i, 0.0f));
  // The angle that the sphere subtends; from inside, every direction is possible.
  const auto inside = d2 <= r2;
  const Lanes sin_b = a.radius * inverse;
  const Lanes cos_b = root(at_least(1.0f - sin_b * sin_b, 0.0f));
  // Angle between axis and receiver, minus the normal cone, minus the sphere.
  const auto in_cone = cos_w > a.cos_normals;
  const Lanes cos_x = in_cone ? one : cos_w * a.cos_normals + sin_w * a.sin_normals;
  const Lanes sin_x = in_cone ? zero : at_least(sin_w * a.cos_normals - cos_w * a.sin_normals, 0.0f);
  const Lanes cos_m = (inside | (cos_x > cos_b)) ? one : cos_x * cos_b + sin_x * sin_b;
  const Lanes cos_r = (inside | (cos_i > cos_b)) ? one : cos_i * cos_b + sin_i * sin_b;
  const Lanes half = sin_b > 1.0f ? one : at_least(sin_b, 1e-6f);
  const Lanes value = a.strength * at_least(mean_cosine(cos_x, half), kMinCosine) *
                      (kGrazing + (1.0f - kGrazing) * mean_cosine(cos_i, half)) /
                      at_least(d2 + a.spread2, 1e-36f);
  const auto excluded = (cos_m < a.cos_emission) | (cos_r < -kSlack) | (d2 > a.reach2);
  out = excluded ? zero : value;
}

KILN_WIDE void LightTree::weigh(int32_t node, const Vec3& p, const Vec3& n, Weights& out) const {
  out.width = node == 0 ? root_width_ : kWidth;
  const Group* group = groups_.data() + node;
  for (int i = 0; i < out.width; i += kLanes) {
    Lanes lanes;
    importance(*group++, p, n, lanes);
    std::memcpy(out.of + i, &lanes, sizeof lanes);
  }
  double sum = 0;
  for (int i = 0; i < out.width; ++i) out.upto[i] = sum += static_cast<double>(out.of[i]);
}

LightTree::Choice LightTree::choose(const Vec3& p, const Vec3& n, float u) const {
  if (groups_.empty()) return {};
  double left = refined(u, key_of(u, p)), chance = 1;
  Weights w;
  for (int32_t at = 0;;) {
    weigh(at, p, n, w);
    if (!(w.total() > 0)) return {};
    left *= w.total();
    int chosen = 0;  // first running sum above `left`; branch-free: unpredictable
    for (int i = 0; i + 1 < w.width; ++i) chosen += left >= w.upto[i];
    while (!(w.of[chosen] > 0.0f)) --chosen;  // `left` was rounded up to the total
    const double weight = w.of[chosen];
    chance *= weight / w.total();
    left = std::clamp((left - (chosen ? w.upto[chosen - 1] : 0)) / weight, 0.0, 0x1.fffffffffffffp-1);
    at = groups_[static_cast<size_t>(at + chosen / kLanes)].child[chosen % kLanes];
    if (at < 0) return {static_cast<uint32_t>(~at), static_cast<float>(chance)};
  }
}

float LightTree::probability(uint32_t light, const Vec3& p, const Vec3& n) const {
  uint64_t trail = trails_[light];
  double chance = 1;
  Weights w;
  for (int32_t at = 0;;) {
    weigh(at, p, n, w);
    const int bits = at == 0 ? kRootTrailBits : kTrailBits;
    const int chosen = static_cast<int>(trail & ((1u << bits) - 1));
    trail >>= bits;
    if (!(w.of[chosen] > 0.0f)) return 0.0f;
    chance *= static_cast<double>(w.of[chosen]) / w.total();
    at = groups_[static_cast<size_t>(at + chosen / kLanes)].child[chosen % kLanes];
    if (at < 0) return static_cast<float>(chance);
  }
}

}  // namespace kiln
