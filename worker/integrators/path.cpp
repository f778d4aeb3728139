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
  const Bsdf* bsdf;
  Frame frame;  // around the shading normal
  Vec3 wo;      // local, towards the texel

  float direction_pdf(const Vec3& local) const {
    return bsdf ? pdf(*bsdf, wo, local) : mixed_hemisphere_pdf(local.z);
  }
};

void PathIntegrator::light(const Vertex& v, const LightSample& s, uint32_t bounces, Splats& out,
                           Vec3* reflected) const {
  if (!(max_component(s.weight) > 0.0f) || (bounces == 0 && s.indirect_only)) return;
  const Vec3 local = v.frame.to_local(s.direction);
  if (local.z <= 0.0f || dot(s.direction, v.point.ng) <= 0.0f) return;
  Vec3 contribution = s.weight;
  if (s.pdf > 0.0f) contribution *= s.pdf / (s.pdf + v.direction_pdf(local));
  if (v.bsdf) {
    contribution *= evaluate(*v.bsdf, v.wo, local) * local.z;
    if (!(max_component(contribution) > 0.0f)) return;
  }
  const Vec3 origin = offset_origin(v.point.position, v.point.ng, v.point.error);
  Ray ray{origin, s.direction};
  if (!s.far) {
    ray.direction = v.point.position + s.segment - origin;
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
  if (!lights_.local.empty()) {
    const Vec2 choice = stream.pair(dimension(bounces, kLocalLight));
    light(v, lights_.local.sample(surfaces_, v.point.position, choice.x,
                                  stream.pair(dimension(bounces, kLocalPoint))),
          bounces, out, reflected);
  }
  if (!lights_.directional.empty()) {
    const Vec2 choice = stream.pair(dimension(bounces, kSun));
    light(v, lights_.directional.sample(choice.x, stream.pair(dimension(bounces, kSunPoint))), bounces, out,
          reflected);
  }
  if (lights_.environment.wants_sampling())
    light(v, lights_.environment.sample(stream.pair(dimension(bounces, kEnvironment))), bounces, out, reflected);
}

Vec3 PathIntegrator::emitted(const SurfacePoint& from, const Hit& hit, const SurfacePoint& at,
                             const Vec3& direction, float pdf) const {
  const Vec3 emission = emission_at(surfaces_.material(hit.instance), at.attributes);
  if (!(max_component(emission) > 0.0f)) return Vec3(0.0f);
  const float other = lights_.local.pdf(surfaces_, from.position, hit.instance, hit.triangle, direction, hit.t);
  return emission * (pdf / (pdf + other));
}

Vec3 PathIntegrator::incoming(const SurfacePoint& receiver, Vec3 direction, float pdf,
                              const SampleStream& stream, Splats& out) const {
  Vec3 sum(0.0f), throughput(1.0f);
  SurfacePoint from = receiver;
  for (uint32_t bounces = 0;; ++bounces) {
    ++out.rays;
    const Hit hit = tracer_.intersect({offset_origin(from.position, from.ng, from.error), direction},
                                      stream.bits(dimension(bounces, kDirection)));
    if (!hit.valid()) {
      const Environment& environment = lights_.environment;
      if (counts(bounces) && !environment.is_black() && !(bounces == 0 && environment.indirect_only()))
        sum += throughput * environment.radiance(direction) * (pdf / (pdf + environment.pdf(direction)));
      return sum;
    }
    SurfacePoint at = surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2);
    const Material& material = surfaces_.material(hit.instance);
    if (dot(direction, at.ng) > 0.0f) {  // a back face
      if (!is_double_sided(material)) {
        if (bounces == 0) out.inside = true;
        return sum;
      }
      at.ng = -at.ng;
      at.ns = -at.ns;
    }
    if (counts(bounces) && is_emissive(material)) sum += throughput * emitted(from, hit, at, direction, pdf);
    if (bounces >= settings_.max_bounces || !settings_.indirect) return sum;

    const Bsdf bsdf = bsdf_at(material, at.attributes);
    if (dot(direction, at.ns) >= 0.0f) at.ns = at.ng;  // seen from below the shading horizon
    const Vertex vertex{at, &bsdf, Frame(at.ns), Frame(at.ns).to_local(-direction)};
    Vec3 reflected(0.0f);
    direct(vertex, stream, bounces + 1, out, &reflected);
    sum += throughput * reflected;

    const Vec2 layer = stream.pair(dimension(bounces + 1, kLayer));
    const BsdfSample s =
        kiln::sample(bsdf, vertex.wo, layer.x, stream.pair(dimension(bounces + 1, kDirection)));
    if (!(max_component(s.weight) > 0.0f)) return sum;
    direction = vertex.frame.to_world(s.direction);
    if (dot(direction, at.ng) <= 0.0f) return sum;  // nothing leaks through the surface itself
    throughput *= s.weight;
    if (bounces + 1 >= kRouletteAfter) {
      const float survival = std::min(1.0f, max_component(throughput));
      if (layer.y >= survival) return sum;
      throughput /= survival;
    }
    pdf = s.pdf;
    from = at;
  }
}

void PathIntegrator::sample(const SurfacePoint& receiver, const SampleStream& stream, Splats& out) const {
  const Vertex texel{receiver, nullptr, Frame(receiver.ns), Vec3(0.0f)};
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
