#include "worker/lights/local_lights.h"

namespace kiln {
namespace {

constexpr size_t kFew = 32;  // above this many lights the choice is by power alone

// Mean emitted luminance over a triangle, from a fixed 4 x 4 pattern.
float mean_emission(const Surfaces& s, uint32_t instance, uint32_t triangle) {
  const Material& material = s.material(instance);
  float sum = 0;
  for (int i = 0; i < 16; ++i) {
    const Vec2 b = uniform_triangle(
        Vec2((static_cast<float>(i % 4) + 0.5f) / 4.0f, (static_cast<float>(i / 4) + 0.5f) / 4.0f));
    sum += luminance(emission_at(material, s.attributes(instance, triangle, b.x, b.y)));
  }
  return sum / 16.0f;
}

}  // namespace

void LocalLights::add_emitters(const Surfaces& s, uint32_t instance) {
  const Mesh& mesh = s.scene().meshes[s.scene().instances[instance].mesh];
  const bool both_sides = is_double_sided(s.material(instance));
  std::vector<float> emission(mesh.triangles.size());
  float largest = 0;
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
    largest = std::max(largest, emission[t] = mean_emission(s, instance, t));
  first_emitter_[instance] = static_cast<uint32_t>(emitter_of_.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    // The floor keeps a triangle samplable whose texture shines only between the pattern's points.
    const float mean = std::max(emission[t], 1e-3f * largest);
    Vec3 p[3];
    s.corners(instance, t, p);
    const float area = 0.5f * length(cross(p[1] - p[0], p[2] - p[0]));
    const bool shines = mean > 0.0f && area > 0.0f;
    emitter_of_.push_back(shines ? static_cast<uint32_t>(triangles_.size()) : ~0u);
    if (!shines) continue;
    const Vec3 centre = (p[0] + p[1] + p[2]) / 3.0f;
    float radius2 = 0;
    for (const Vec3& corner : p) radius2 = std::max(radius2, dot(corner - centre, corner - centre));
    const float power = mean * area * kPi * (both_sides ? 2.0f : 1.0f);
    triangles_.push_back({instance, t, centre, radius2, area, power, power * (0.25f * kInvPi)});
  }
}

void LocalLights::finish(const Surfaces& s) {
  first_emitter_.assign(s.scene().instances.size(), ~0u);
  for (uint32_t i = 0; i < s.scene().instances.size(); ++i)
    if (is_emissive(s.material(i))) add_emitters(s, i);
  std::vector<double> weights;
  for (const Punctual& l : punctual_)
    weights.push_back(std::visit([](const auto& x) { return x.power(); }, l));
  for (const Emitter& e : triangles_) weights.push_back(e.power);
  by_power_ = DiscreteDistribution(weights);
}

float LocalLights::importance(size_t light, const Vec3& p) const {
  if (light < punctual_.size())
    return luminance(std::visit([&](const auto& x) { return x.irradiance(p); }, punctual_[light]));
  const Emitter& e = triangles_[light - punctual_.size()];
  const Vec3 d = e.centre - p;
  return e.strength / (dot(d, d) + e.radius2);
}

std::pair<uint32_t, float> LocalLights::choose(const Vec3& p, float u) const {
  if (size() == 1 && punctual_.empty()) return {0, 1.0f};
  if (size() > kFew) {
    const auto draw = by_power_.sample(u);
    return {draw.index, by_power_.probability(draw.index)};
  }
  float weights[kFew];
  float total = 0;
  for (size_t i = 0; i < size(); ++i) total += weights[i] = importance(i, p);
  if (!(total > 0.0f) || !std::isfinite(total)) return {0, 0.0f};
  float left = u * total;
  uint32_t chosen = 0;
  for (uint32_t i = 0; i < size(); ++i) {
    if (weights[i] <= 0.0f) continue;
    chosen = i;
    if (left < weights[i]) break;
    left -= weights[i];
  }
  return {chosen, weights[chosen] / total};
}

float LocalLights::probability(size_t light, const Vec3& p) const {
  if (size() == 1 && punctual_.empty()) return 1.0f;
  if (size() > kFew) return by_power_.probability(static_cast<uint32_t>(light));
  float total = 0;
  for (size_t i = 0; i < size(); ++i) total += importance(i, p);
  return total > 0.0f && std::isfinite(total) ? importance(light, p) / total : 0.0f;
}

LightSample LocalLights::sample_triangle(const Surfaces& s, const Emitter& e, const Vec3& p,
                                         const Vec2& u) const {
  LightSample out;
  const Vec2 b = uniform_triangle(u);
  const SurfacePoint q = s.at(e.instance, e.triangle, b.x, b.y);
  const Vec3 d = q.position - p;
  const float d2 = dot(d, d);
  if (!(d2 > 0.0f)) return out;
  out.direction = d / std::sqrt(d2);
  float cos_light = -dot(out.direction, q.ng);
  Vec3 side = q.ng;
  if (cos_light < 0.0f && is_double_sided(s.material(e.instance))) {
    cos_light = -cos_light;
    side = -side;
  }
  if (!(cos_light > 0.0f)) return out;
  out.segment = offset_origin(q.position, side, q.error) - p;
  out.pdf = d2 / (cos_light * e.area);
  if (!std::isfinite(out.pdf)) return LightSample{};  // seen edge on: it subtends nothing
  out.weight = emission_at(s.material(e.instance), q.attributes) / out.pdf;
  return out;
}

LightSample LocalLights::sample(const Surfaces& s, const Vec3& p, const Vec3& /*n*/, float u_light,
                                const Vec2& u) const {
  const auto [light, chance] = choose(p, u_light);
  LightSample out;
  if (!(chance > 0.0f)) return out;
  if (light >= punctual_.size()) {
    out = sample_triangle(s, triangles_[light - punctual_.size()], p, u);
    out.pdf *= chance;
  } else {
    std::visit(
        [&](const auto& x) {
          out.segment = x.position() - p;
          out.direction = normalize_or(out.segment, Vec3(0, 1, 0));
          out.weight = x.irradiance(p);
          out.indirect_only = x.bake == BakeMode::kIndirect;
        },
        punctual_[light]);
  }
  out.weight = out.weight / chance;
  return out;
}

float LocalLights::pdf(const Vec3& p, const Vec3& /*n*/, uint32_t instance, uint32_t triangle,
                       float cos_light, float t) const {
  if (first_emitter_[instance] == ~0u || !(cos_light > 0.0f)) return 0.0f;
  const uint32_t emitter = emitter_of_[first_emitter_[instance] + triangle];
  if (emitter == ~0u) return 0.0f;
  const float density = t * t / (cos_light * triangles_[emitter].area);
  return std::isfinite(density) ? probability(punctual_.size() + emitter, p) * density : 0.0f;
}

}  // namespace kiln
