#include "worker/integrators/path.h"

#include "common/math/frame.h"
#include "common/math/warp.h"

namespace kiln {
namespace {

// Pairs of dimensions of the vertex after `bounces` reflections. Dimension 0 picks the texel's site.
enum Dimension : uint32_t { kDirection, kLayer, kLocalLight, kLocalPoint, kSun, kSunPoint, kEnvironment, kPerVertex };
uint32_t dimension(uint32_t bounces, Dimension d) { return 1 + bounces * kPerVertex + d; }

constexpr uint32_t kRouletteAfter = 3;  // reflections that every path may make

}  // namespace

// A point that light arrives at: the texel itself (bsdf null: any linear measure of the incident light is
// wanted, sampled with the mixed hemisphere) or a reflecting point of the path.
struct PathIntegrator::Vertex {
  const SurfacePoint& point;
  const SeenBsdf* bsdf;
  Frame frame;  // around the shading normal

  Vec3 origin() const { return offset_origin(point.position, point.ng, point.error); }
};

void PathIntegrator::light(const Vertex& v, const LightSample& s, uint32_t bounces, Splats& out,
                           Vec3* reflected) const {
  if (!(max_component(s.weight) > 0.0f) || (bounces == 0 && s.indirect_only)) return;
  const Vec3 local = v.frame.to_local(s.direction);
  if (local.z <= 0.0f || dot(s.direction, v.point.ng) <= 0.0f) return;
  Vec3 contribution = s.weight;
  float direction_pdf = 0.0f;
  if (v.bsdf) {
    const BsdfValue value = v.bsdf->value(local);
    contribution *= value.f * local.z;
    if (!(max_component(contribution) > 0.0f)) return;
    direction_pdf = value.pdf;
  } else {
    direction_pdf = mixed_hemisphere_pdf(local.z);
  }
  if (s.pdf > 0.0f) contribution *= s.pdf / (s.pdf + direction_pdf);
  Ray ray{v.origin(), s.direction};
  if (!s.far) {
    ray.direction = v.point.position + s.segment - ray.origin;
    ray.far = 1.0f;
  }
  ++out.rays;
  const float passed = tracer_.transmittance(ray);
  if (!(passed > 0.0f)) return;
  if (reflected)
    *reflected += contribution * passed;
  else
    out.add(s.direction, contribution * passed);
}

void PathIntegrator::direct(const Vertex& v, const SampleStream& stream, uint32_t bounces, Splats& out,
                            Vec3* reflected) const {
  const LocalLights& local = lights_.local;
  const DirectionalLights& suns = lights_.directional;
  if (!local.empty()) {
    const float choice = local.wants_choice() ? stream.single(dimension(bounces, kLocalLight)) : 0.0f;
    const Vec2 point = local.wants_point() ? stream.pair(dimension(bounces, kLocalPoint)) : Vec2(0.0f);
    light(v, local.sample(surfaces_, v.point.position, choice, point), bounces, out, reflected);
  }
  if (!suns.empty() && suns.may_light(v.point.ns)) {
    const float choice = suns.wants_choice() ? stream.single(dimension(bounces, kSun)) : 0.0f;
    const Vec2 point = suns.wants_point() ? stream.pair(dimension(bounces, kSunPoint)) : Vec2(0.0f);
    light(v, suns.sample(choice, point), bounces, out, reflected);
  }
  if (lights_.environment.wants_sampling())
    light(v, lights_.environment.sample(stream.pair(dimension(bounces, kEnvironment))), bounces, out, reflected);
}

Vec3 PathIntegrator::emitted(const Vec3& from, const Hit& hit, const SurfacePoint& at, const Material& material,
                             const Vec3& direction, float pdf) const {
  const Vec3 emission = emission_at(material, at.attributes);
  if (!(max_component(emission) > 0.0f)) return Vec3(0.0f);
  const float other =
      lights_.local.pdf(from, hit.instance, hit.triangle, std::abs(dot(direction, at.ng)), hit.t);
  return emission * (pdf / (pdf + other));
}

Vec3 PathIntegrator::missed(const Vec3& direction, float pdf, uint32_t bounces) const {
  const Environment& environment = lights_.environment;
  if (!counts(bounces) || environment.is_black() || (bounces == 0 && environment.indirect_only()))
    return Vec3(0.0f);
  if (!environment.wants_sampling()) return environment.radiance(direction);
  return environment.radiance(direction) * (pdf / (pdf + environment.pdf(direction)));
}

Vec3 PathIntegrator::incoming(const SurfacePoint& receiver, Vec3 direction, float pdf,
                              const SampleStream& stream, Splats& out) const {
  Vec3 sum(0.0f), throughput(1.0f);
  Vec3 from = receiver.position;
  Vec3 origin = offset_origin(receiver.position, receiver.ng, receiver.error);
  for (uint32_t bounces = 0;; ++bounces) {
    ++out.rays;
    const Hit hit = tracer_.intersect({origin, direction}, stream.bits(dimension(bounces, kDirection)));
    if (!hit.valid()) return sum + throughput * missed(direction, pdf, bounces);
    SurfacePoint at = surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2);
    const SurfaceKind& kind = surfaces_.kind(hit.instance);
    if (dot(direction, at.ng) > 0.0f) {  // a back face
      if (!kind.double_sided) {
        if (bounces == 0) out.inside = true;
        return sum;
      }
      at.ng = -at.ng;
      at.ns = -at.ns;
    }
    if (kind.emissive && counts(bounces))
      sum += throughput * emitted(from, hit, at, *kind.material, direction, pdf);
    if (bounces >= settings_.max_bounces || !settings_.indirect) return sum;

    if (dot(direction, at.ns) >= 0.0f) at.ns = at.ng;  // seen from below the shading horizon
    const Frame frame(at.ns);
    const SeenBsdf bsdf(bsdf_at(*kind.material, at.attributes), frame.to_local(-direction));
    const Vertex vertex{at, &bsdf, frame};
    Vec3 reflected(0.0f);
    direct(vertex, stream, bounces + 1, out, &reflected);
    sum += throughput * reflected;

    const bool roulette = bounces + 1 >= kRouletteAfter;
    const Vec2 layer =
        roulette || bsdf.wants_layer() ? stream.pair(dimension(bounces + 1, kLayer)) : Vec2(0.0f);
    const BsdfSample s = bsdf.sample(layer.x, stream.pair(dimension(bounces + 1, kDirection)));
    if (!(max_component(s.weight) > 0.0f)) return sum;
    direction = frame.to_world(s.direction);
    if (dot(direction, at.ng) <= 0.0f) return sum;  // nothing leaks through the surface itself
    throughput *= s.weight;
    if (roulette) {
      const float survival = std::min(1.0f, max_component(throughput));
      if (layer.y >= survival) return sum;
      throughput /= survival;
    }
    pdf = s.pdf;
    from = at.position;
    origin = vertex.origin();
  }
}

void PathIntegrator::sample(const SurfacePoint& receiver, const SampleStream& stream, Splats& out) const {
  const Vertex texel{receiver, nullptr, Frame(receiver.ns)};
  if (settings_.direct) direct(texel, stream, 0, out, nullptr);
  const Vec3 local = mixed_hemisphere(stream.pair(dimension(0, kDirection)));
  const Vec3 direction = texel.frame.to_world(local);
  if (dot(direction, receiver.ng) <= 0.0f) return;  // below the surface: no light arrives from there
  const float density = mixed_hemisphere_pdf(local.z);
  const Vec3 radiance = incoming(receiver, direction, density, stream, out);
  // Written so that NaN passes: the film counts it.
  if (!(max_component(radiance) <= 0.0f)) out.add(direction, radiance / density);
}

}  // namespace kiln
