#include "worker/lights/directional.h"

#include "common/math/warp.h"
#include "worker/lights/punctual.h"

namespace kiln {

void DirectionalLights::add(RecordReader& r, const Mat4x3& to_world) {
  Light l{Frame(normalize_or(to_world[2], Vec3(0, 1, 0))), Vec3(0.0f), Vec3(0.0f), 0.0f, false};
  l.irradiance = glm::max(r.vec3("color", Vec3(1.0f)) * r.number("intensity", 1.0f), Vec3(0.0f));
  const double half = 0.5 * std::clamp<double>(r.number("angle", 0.0f), 0.0, 180.0) * 0.017453292519943295;
  const double s = std::sin(0.5 * half);
  l.h = static_cast<float>(2.0 * s * s);  // no cancellation for half a degree
  const BakeMode bake = parse_bake(r);
  l.indirect_only = bake == BakeMode::kIndirect;
  if (bake != BakeMode::kNone && max_component(l.irradiance) > 0.0f) lights_.push_back(l);
}

void DirectionalLights::finish() {
  if (lights_.empty()) return;
  std::vector<double> weights;
  for (const Light& l : lights_) weights.push_back(luminance(l.irradiance));
  choice_ = DiscreteDistribution(weights);
  for (uint32_t i = 0; i < lights_.size(); ++i) {
    Light& l = lights_[i];
    any_disc_ = any_disc_ || l.h > 0.0f;
    // Uniform radiance B over the cone: E = B pi sin^2(half) = B pi h (2 - h), and B / pdf = B 2 pi h.
    const float scale = l.h > 0.0f ? 2.0f / (2.0f - l.h) : 1.0f;
    if (choice_.probability(i) > 0.0f) l.weight = l.irradiance * (scale / choice_.probability(i));
  }
  only_direction_ = lights_[0].frame.n;
  const float h = lights_[0].h;
  least_cos_ = -std::sqrt(h * (2.0f - h)) - 1e-5f;  // slightly wider than the disc, for rounding
}

LightSample DirectionalLights::sample(float u_light, const Vec2& u) const {
  const Light& l = lights_[wants_choice() ? choice_.sample(u_light).index : 0];
  LightSample s;
  s.indirect_only = l.indirect_only;
  s.direction = l.h > 0.0f ? l.frame.to_world(uniform_cone(u, l.h)) : l.frame.n;
  s.far = true;
  s.weight = l.weight;
  return s;  // pdf stays 0: no other strategy can find the sun
}

}  // namespace kiln
