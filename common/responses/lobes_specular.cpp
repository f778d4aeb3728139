#include "common/responses/lobes_specular.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/frame.h"
#include "common/math/trig.h"
#include "common/math/trig_double.h"
#include "common/responses/receiver_frame.h"

namespace kiln {
namespace {

constexpr float kLeastAlpha = 1e-3f;  // as in engines, to stay finite

float dice_radiance(float c) {
  const float c2 = c * c;
  return c > 0 ? c2 * (0.35f + 0.25f * c2) : 0.0f;
}

// The set of constants for which the fit below was made; Eq. 8.14, which lobe_irradiance() has, differs a
// little.
float dice_diffuse(float c) {
  return 0.06f + c * (0.129f + 0.0697f * c);
}

float saturate(float x) {
  return std::clamp(x, 0.0f, 1.0f);
}

Vec3 mirrored(const Vec3& m, const Vec3& to_eye) {
  return m * (2 * dot(m, to_eye)) - to_eye;
}

Vec3 schlick(const Vec3& f0, float cosine) {
  const float x = 1 - saturate(cosine);
  return f0 + (Vec3(1.0f) - f0) * (x * x * x * x * x);
}

// Smith's Lambda of GGX.
double lambda(double cosine, double alpha) {
  return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - cosine * cosine) / (cosine * cosine)) - 1);
}

// Heitz 2018, Sampling the GGX Distribution of Visible Normals, JCGT 7(4), for an eye in the plane y = 0.
// Departure: isotropic only.
DVec3 visible_normal(const DVec3& eye, double alpha, double u, double v) {
  const double x = alpha * eye.x, size = std::sqrt(x * x + eye.z * eye.z);
  const DVec3 stretched(x / size, 0, eye.z / size), across(0, 1, 0), up(-stretched.z, 0, stretched.x);
  const double r = std::sqrt(u);
  const SinCosDouble turn = sincos_radians(6.283185307179586 * v);
  const double t1 = r * turn.cos, s = 0.5 * (1 + stretched.z);
  const double t2 = (1 - s) * std::sqrt(1 - t1 * t1) + s * r * turn.sin;
  const DVec3 h = across * t1 + up * t2 + stretched * std::sqrt(std::max(0.0, 1 - t1 * t1 - t2 * t2));
  const DVec3 normal(alpha * h.x, alpha * h.y, std::max(0.0, h.z));
  return normal / std::sqrt(dot(normal, normal));
}

DiceResponse::Scale response(double eye_cosine, double alpha) {
  constexpr int kSamples = 1024;
  const DVec3 eye(std::sqrt(1 - eye_cosine * eye_cosine), 0, eye_cosine);
  // The lobe lies near where the reflection is brightest: between the mirror direction and the normal.
  const double share = (1 - alpha) * (std::sqrt(1 - alpha) + alpha);
  DVec3 axis(-eye.x * share, 0, eye.z * share + 1 - share);
  axis = axis / std::sqrt(dot(axis, axis));
  double f0 = 0, f90 = 0;
  const double one = 1 + lambda(eye_cosine, alpha);
  for (int i = 0; i < kSamples; ++i) {
    const double turns = 0.61803398874989485 * i;
    const DVec3 h = visible_normal(eye, alpha, (i + 0.5) / kSamples, turns - std::floor(turns));
    const double eye_h = dot(eye, h);
    const DVec3 light = h * (2 * eye_h) - eye;
    if (!(light.z > 0)) continue;
    const double x = 1 - eye_h, grazing = x * x * x * x * x;
    const double seen =
        dice_radiance(static_cast<float>(dot(light, axis))) * one / (one + lambda(light.z, alpha));
    f0 += seen * (1 - grazing) / kSamples;
    f90 += seen * grazing / kSamples;
  }
  const double mirror = eye.z * axis.z - eye.x * axis.x;
  const double fit =
      dice_reflection(static_cast<float>(mirror), static_cast<float>(axis.z), static_cast<float>(alpha));
  KILN_CHECK(fit > 0 && f0 >= 0 && f90 >= 0);
  return {static_cast<float>(f0 / fit), static_cast<float>(f90 / fit)};
}

Vec3 dice_specular(const LobeSet& set, const LobeTexel& texel, const Vec3& m, const Vec3& v, float alpha,
                   const Vec3& f0) {
  const Vec3 mirror = mirrored(m, v);
  Vec3 sum(0.0f);
  for (size_t i = 0; i < set.count; ++i)
    sum += texel.lobe[i] * dice_reflection(dot(mirror, set.axis[i]), dot(m, set.axis[i]), alpha);
  const DiceResponse::Scale scale = DiceResponse::get()(dot(m, v), alpha);
  return sum * (f0 * scale.f0 + Vec3(scale.f90));
}

Vec3 gaussian_specular(const LobeSet& set, const LobeTexel& texel, const Vec3& m, const Vec3& v, float alpha,
                       const Vec3& f0) {
  alpha = std::max(alpha, kLeastAlpha);
  const float a2 = alpha * alpha, nv = dot(m, v), away = std::max(nv, 0.1f);
  const Vec3 mirror = mirrored(m, v);
  // Across and in the plane of the reflection. Straight on both are alike, and the product is but rounding.
  const Vec3 side = cross(m, mirror);
  const Vec3 across = dot(side, side) > 1e-8f ? normalize_or(side, m) : Frame(m).x;
  const Vec3 along = cross(mirror, across);
  constexpr float kNu = kGaussianSharpness / 2;
  const float sharp = 2 / a2, x = sharp / (8 * away * away), y = sharp / 8;
  const float wide_x = kNu * x / (kNu + x), wide_y = kNu * y / (kNu + y);
  Vec3 sum(0.0f);
  for (size_t i = 0; i < set.count; ++i) {
    const float p = dot(set.axis[i], across), q = dot(set.axis[i], along);
    const float falloff = exponential(-wide_x * p * p - wide_y * q * q);
    sum += texel.lobe[i] * (std::max(0.0f, dot(set.axis[i], mirror)) * falloff);
  }
  // pi / sqrt((nu + x) (nu + y)) of the convolution, 1 / (pi a2) of the distribution; then G / (4 nl nv) nl,
  // where light comes from the mirror direction, so nl = nv.
  const float shadowing = 0.25f / std::sqrt(nv * nv * (1 - a2) + a2);
  return sum * schlick(f0, nv) * (shadowing / (a2 * std::sqrt((kNu + x) * (kNu + y))));
}

}  // namespace

// The polynomials are Roughton's, fitted to quadrature.
float dice_reflection(float mirror_cosine, float normal_cosine, float alpha) {
  const float s = std::sqrt(alpha), a = alpha;
  const float towards = saturate(s * (3.04989105f + 7.38827044f * a) - a * (6.98300251f + 2.66275692f * a));
  const float diffuse = saturate(a * (5.62669935f + 1.90061249f * a) - s * (0.40054295f + 6.0400987f * a));
  const float mean = mirror_cosine + (normal_cosine - mirror_cosine) * towards;
  const float sharp = dice_radiance(mirror_cosine);
  return sharp + (dice_diffuse(mean) - sharp) * diffuse;
}

DiceResponse::DiceResponse() {
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column)
      entries_.push_back(
          response(std::max(1e-3, column / (kSize - 1.0)), std::max(1e-6, row / (kSize - 1.0))));
}

const DiceResponse& DiceResponse::get() {
  static const DiceResponse kResponse;
  return kResponse;
}

DiceResponse::Scale DiceResponse::operator()(float eye_cosine, float alpha) const {
  const float x = saturate(eye_cosine) * (kSize - 1), y = saturate(alpha) * (kSize - 1);
  const int column = std::min(static_cast<int>(x), kSize - 2), row = std::min(static_cast<int>(y), kSize - 2);
  const float u = x - static_cast<float>(column), v = y - static_cast<float>(row);
  const Scale* at = &entries_[static_cast<size_t>(row) * kSize + static_cast<size_t>(column)];
  const auto mix = [&](float Scale::*part) {
    const float low = at[0].*part + u * (at[1].*part - at[0].*part);
    const float high = at[kSize].*part + u * (at[kSize + 1].*part - at[kSize].*part);
    return low + v * (high - low);
  };
  return {mix(&Scale::f0), mix(&Scale::f90)};
}

Vec3 lobes_specular(const LobeSet& set, const LobeTexel& texel, const Vec3& n, const Vec3& m,
                    const Vec3& to_eye, float roughness, const Vec3& f0) {
  if (!(dot(m, to_eye) > 0)) return Vec3(0.0f);
  KILN_CHECK(set.count <= kMaxLobes && roughness >= 0 && roughness <= 1);
  const float alpha = roughness * roughness;
  Vec3 normal = m, eye = to_eye;
  if (set.is_local) {
    const ReceiverFrame frame(n);
    normal = frame.to_local(m), eye = frame.to_local(to_eye);
  }
  const Vec3 sum = set.is_dice ? dice_specular(set, texel, normal, eye, alpha, f0)
                               : gaussian_specular(set, texel, normal, eye, alpha, f0);
  return {std::max(0.0f, sum.x), std::max(0.0f, sum.y), std::max(0.0f, sum.z)};
}

}  // namespace kiln
