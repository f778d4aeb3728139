#include "worker/lights/local_lights.h"

#include "common/math/warp.h"
#include "worker/lights/emission_map.h"

namespace kiln {
namespace {

// A light of the record's type, or nothing.
template <class Light, class... Others>
Expected<std::optional<AnyLight>> parse_light(RecordReader& r, const Record& record, const Scene& scene) {
  if (record.type == Light::kType) {
    KILN_TRY(Light light, Light::parse(r, record, scene));
    return std::optional<AnyLight>(std::move(light));
  }
  if constexpr (sizeof...(Others) > 0)
    return parse_light<Others...>(r, record, scene);
  else
    return std::optional<AnyLight>();
}
template <class... Lights>
auto parse_any(const std::variant<Lights...>*, RecordReader& r, const Record& record, const Scene& scene) {
  return parse_light<Lights...>(r, record, scene);
}

}  // namespace

Expected<bool> LocalLights::add(RecordReader& r, const Record& record, const Scene& scene) {
  KILN_TRY(std::optional<AnyLight> light, parse_any(static_cast<const AnyLight*>(nullptr), r, record, scene));
  if (!light) return false;
  std::visit(
      [&]<class Light>(Light& l) {
        if (l.bake == BakeMode::kNone || !(l.power() > 0.0)) return;
        if (!Light::kDelta) area_lights_.push_back(static_cast<uint32_t>(lights_.size()));
        lights_.push_back(std::move(l));
      },
      *light);
  return true;
}

void LocalLights::add_emitters(const Surfaces& s, uint32_t instance, std::vector<LightBounds>& bounds) {
  const Mesh& mesh = s.scene().meshes[s.scene().instances[instance].mesh];
  const EmissionMap emission(emission_parts(s.material(instance)), mesh.triangles.size());
  first_emitter_[instance] = static_cast<uint32_t>(emitter_of_.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const double mean = emission.mean(
        {s.attributes(instance, t, 0, 0), s.attributes(instance, t, 1, 0), s.attributes(instance, t, 0, 1)});
    Vec3 p[3];
    s.corners(instance, t, p);
    const DVec3 normal = glm::cross(DVec3(p[1]) - DVec3(p[0]), DVec3(p[2]) - DVec3(p[0]));
    const double area = 0.5 * glm::length(normal);
    const bool shines = mean > 0.0 && static_cast<float>(area) > 0.0f;
    emitter_of_.push_back(shines ? static_cast<uint32_t>(triangles_.size()) : ~0u);
    if (!shines) continue;
    LightBounds b;
    b.centre = Vec3((DVec3(p[0]) + DVec3(p[1]) + DVec3(p[2])) / 3.0);
    for (const Vec3& corner : p) b.radius = std::max(b.radius, length(corner - b.centre));
    b.axis = s.at(instance, t, 1.0f / 3, 1.0f / 3).ng;
    b.cos_normals = 1.0;
    b.two_sided = is_double_sided(s.material(instance));
    b.strength = mean * area;
    bounds.push_back(b);
    triangles_.push_back({instance, t, static_cast<float>(area)});
  }
}

void LocalLights::finish(const Surfaces& s, LightChoice choice) {
  choice_ = choice;
  std::vector<LightBounds> bounds;
  for (const AnyLight& l : lights_) bounds.push_back(std::visit([](const auto& x) { return x.bounds(); }, l));
  first_emitter_.assign(s.scene().instances.size(), ~0u);
  for (uint32_t i = 0; i < s.scene().instances.size(); ++i)
    if (is_emissive(s.material(i))) add_emitters(s, i, bounds);
  if (choice == LightChoice::kTree) {
    tree_ = LightTree(bounds);
    return;
  }
  std::vector<double> weights;
  for (const AnyLight& l : lights_) weights.push_back(std::visit([](const auto& x) { return x.power(); }, l));
  for (size_t i = weights.size(); i < bounds.size(); ++i)
    weights.push_back(bounds[i].strength * M_PI * (bounds[i].two_sided ? 2.0 : 1.0));
  if (choice == LightChoice::kUniform) std::fill(weights.begin(), weights.end(), 1.0);
  fixed_ = DiscreteDistribution(weights);
}

LightTree::Choice LocalLights::choose(const Vec3& p, const Vec3& n, float u) const {
  if (size() == 1) return {0, 1.0f};
  if (choice_ == LightChoice::kTree) return tree_.choose(p, n, u);
  const auto draw = fixed_.sample(u);
  return {draw.index, fixed_.probability(draw.index)};
}

float LocalLights::probability_of(uint32_t light, const Vec3& p, const Vec3& n) const {
  if (size() == 1) return 1.0f;
  return choice_ == LightChoice::kTree ? tree_.probability(light, p, n) : fixed_.probability(light);
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
  if (!std::isfinite(out.pdf)) return LightSample{};  // seen edge on: zero solid angle
  out.weight = emission_at(s.material(e.instance), q.attributes) / out.pdf;
  // Paths do not hit lights without an emitting surface: only light sampling finds them.
  if (!s.scene().instances[e.instance].cast) out.pdf = 0.0f;
  // Where the surface is cut out or partly transparent, rays that would have hit it pass through.
  if (s.has_alpha(e.instance)) out.weight *= opacity_at(s.material(e.instance), q.attributes);
  return out;
}

LightSample LocalLights::sample(const Surfaces& s, const Vec3& p, const Vec3& n, float u_light,
                                const Vec2& u) const {
  const auto [light, chance] = choose(p, n, u_light);
  LightSample out;
  if (!(chance > 0.0f)) return out;
  if (light >= lights_.size()) {
    out = sample_triangle(s, triangles_[light - lights_.size()], p, u);
  } else {
    std::visit(
        [&](const auto& x) {
          out = x.sample(p, u);
          out.indirect_only = x.bake == BakeMode::kIndirect;
        },
        lights_[light]);
  }
  out.pdf *= chance;
  out.weight = out.weight / chance;
  return out;
}

std::optional<LocalLights::Crossing> LocalLights::crossing(uint32_t light, const Vec3& p, const Vec3& n,
                                                           const Segment& s) const {
  return std::visit(
      [&]<class Light>(const Light& l) -> std::optional<Crossing> {
        if constexpr (!Light::kDelta) {
          const double distance = l.distance(p, s.origin, s.direction);
          if (distance >= s.from && distance < s.to)
            return Crossing{l.radiance(), distance, l.pdf(p, s.direction) * probability_of(light, p, n),
                            l.bake == BakeMode::kIndirect};
        }
        return std::nullopt;
      },
      lights_[light]);
}

float LocalLights::pdf(const Vec3& p, const Vec3& n, uint32_t instance, uint32_t triangle, float cos_light,
                       float t) const {
  if (first_emitter_[instance] == ~0u || !(cos_light > 0.0f)) return 0.0f;
  const uint32_t emitter = emitter_of_[first_emitter_[instance] + triangle];
  if (emitter == ~0u) return 0.0f;
  const float density = t * t / (cos_light * triangles_[emitter].area);
  return std::isfinite(density)
             ? probability_of(static_cast<uint32_t>(lights_.size()) + emitter, p, n) * density
             : 0.0f;
}

}  // namespace kiln
