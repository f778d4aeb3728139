#include "common/responses/evaluate.h"

#include "common/math/trig.h"
#include "common/responses/basis.h"

namespace kiln {
namespace {

Vec3 channel(const ShL1Texel& t, int c) {
  return {t.l1[0][c], t.l1[1][c], t.l1[2][c]};
}

}  // namespace

float sh_l1_irradiance_nonlinear(float l0, const Vec3& l1, const Vec3& n) {
  if (!(l0 > 0)) return 0.0f;
  const float size = length(l1);
  if (!(size > 0)) return kPi * l0;
  const float a = std::min(size / l0, 1.0f);
  const float q = 0.5f + 0.5f * std::clamp(dot(n, l1) / size, -1.0f, 1.0f);
  const float p = 1 + 2 * a, k = (1 - a) / (1 + a);
  return kPi * l0 * (k + (1 - k) * (p + 1) * power(q, p));
}

Vec3 irradiance_linear(const ShL1Texel& t, const Vec3& n) {
  Vec3 e;
  for (int c = 0; c < 3; ++c) e[c] = std::max(0.0f, sh_l1_irradiance(t.l0[c], channel(t, c), n));
  return e;
}

Vec3 irradiance_nonlinear(const ShL1Texel& t, const Vec3& n) {
  Vec3 e;
  for (int c = 0; c < 3; ++c) e[c] = sh_l1_irradiance_nonlinear(t.l0[c], channel(t, c), n);
  return e;
}

DominantLight dominant_light(const ShL1Texel& t, const Vec3& fallback) {
  const float l0 = t.l0.x + t.l0.y + t.l0.z;
  Vec3 l1;
  for (int k = 0; k < 3; ++k) l1[k] = t.l1[k].x + t.l1[k].y + t.l1[k].z;
  const float size = length(l1);
  if (!(l0 > 0) || !(size > 0)) return {fallback, 0.0f};
  return {l1 / size, std::min(size / l0, 1.0f)};
}

float softened_roughness(float roughness, float focus) {
  return 1 - (1 - roughness) * std::sqrt(focus);
}

Vec3 specular_from_l1(const ShL1Texel& t, const Vec3& n, const Vec3& v, float roughness, const Vec3& f0) {
  const DominantLight light = dominant_light(t, n);
  const float nl = dot(n, light.direction), nv = dot(n, v);
  if (nl <= 0 || nv <= 0 || light.focus <= 0) return Vec3(0.0f);
  const float r = softened_roughness(roughness, light.focus);
  const float alpha = std::max(r * r, 1e-3f), a2 = alpha * alpha;
  const Vec3 h = normalize_or(light.direction + v, n);
  const float nh = std::max(dot(n, h), 0.0f), vh = std::max(dot(v, h), 0.0f);
  const float d = nh * nh * (a2 - 1) + 1;
  const float distribution = a2 / (kPi * d * d);
  const float visibility =
      0.5f / (nl * std::sqrt(nv * nv * (1 - a2) + a2) + nv * std::sqrt(nl * nl * (1 - a2) + a2));
  const float m = 1 - vh, m5 = m * m * m * m * m;
  const Vec3 fresnel = f0 + (Vec3(1.0f) - f0) * m5;
  return irradiance_linear(t, light.direction) * fresnel * (distribution * visibility * nl);
}

}  // namespace kiln
