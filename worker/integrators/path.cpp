#include "worker/integrators/path.h"

#include "common/math/frame.h"
#include "common/math/trig.h"
#include "common/math/warp.h"

namespace kiln {
namespace {

// Pairs of dimensions of the vertex after `bounces` reflections. Dimension 0 picks the texel's site.
enum Dimension : uint32_t {
  kDirection,
  kLayer,
  kLocalLight,
  kLocalPoint,
  kSun,
  kSunPoint,
  kEnvironment,
  kPerVertex
};
uint32_t dimension(uint32_t bounces, Dimension d) {
  return 1 + bounces * kPerVertex + d;
}

constexpr uint32_t kMostPasses = 64;    // surfaces of glass between two vertices; what goes further is lost
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
  const Vec3 passed = tracer_.transmittance(ray);
  if (!(max_component(passed) > 0.0f)) return;
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
    light(v, local.sample(surfaces_, v.point.position, v.point.ns, choice, point), bounces, out, reflected);
  }
  if (!suns.empty() && suns.may_light(v.point.ns)) {
    const float choice = suns.wants_choice() ? stream.single(dimension(bounces, kSun)) : 0.0f;
    const Vec2 point = suns.wants_point() ? stream.pair(dimension(bounces, kSunPoint)) : Vec2(0.0f);
    light(v, suns.sample(choice, point), bounces, out, reflected);
  }
  if (lights_.environment.wants_sampling())
    light(v, lights_.environment.sample(stream.pair(dimension(bounces, kEnvironment))), bounces, out,
          reflected);
}

Vec3 PathIntegrator::missed(const Vec3& direction, float pdf, uint32_t bounces) const {
  const Environment& environment = lights_.environment;
  if (!counts(bounces) || environment.is_black() || (bounces == 0 && environment.indirect_only()))
    return Vec3(0.0f);
  if (!environment.wants_sampling()) return environment.radiance(direction);
  return environment.radiance(direction) * (pdf / (pdf + environment.pdf(direction)));
}

// A path on its way from a texel, of which `throughput` has not been gathered yet.
struct PathIntegrator::Path {
  Task* task;
  Vec3 from, from_normal;  // the last vertex that reflected, or the texel
  Vec3 origin, direction;  // of the ray: offset, and behind the glass that was passed since
  float distance;          // travelled since `from`
  Vec3 absorption;         // of the medium that the ray is in
  Vec3 throughput, sum;
  float pdf;  // of direction
  Vec3 first_direction;
  float first_pdf;
  uint32_t bounces, passes;  // reflections; surfaces of glass passed since the last
  Hit hit;
  SurfacePoint at;
  bool leaves;  // met a back face
};

Vec3 PathIntegrator::emitted(const Path& p) const {
  const Vec3 emission = emission_at(*surfaces_.kind(p.hit.instance).material, p.at.attributes);
  if (!(max_component(emission) > 0.0f)) return Vec3(0.0f);
  const float other = lights_.local.pdf(p.from, p.from_normal, p.hit.instance, p.hit.triangle,
                                        std::abs(dot(p.direction, p.at.ng)), p.distance);
  return emission * (p.pdf / (p.pdf + other));
}

bool PathIntegrator::start(Path& path, Task& task) const {
  const SurfacePoint& receiver = task.receiver;
  const Vertex texel{receiver, nullptr, Frame(receiver.ns)};
  if (settings_.direct) direct(texel, task.stream, 0, task.splats, nullptr);
  const Vec3 local = mixed_hemisphere(task.stream.pair(dimension(0, kDirection)));
  path.direction = texel.frame.to_world(local);
  if (dot(path.direction, receiver.ng) <= 0.0f)
    return false;  // below the surface: no light arrives from there
  path.task = &task;
  path.from = receiver.position;
  path.from_normal = receiver.ns;
  path.origin = texel.origin();
  path.distance = 0.0f;
  path.absorption = Vec3(0.0f);
  path.throughput = Vec3(1.0f);
  path.sum = Vec3(0.0f);
  path.bounces = path.passes = 0;
  path.first_direction = path.direction;
  path.first_pdf = path.pdf = mixed_hemisphere_pdf(local.z);
  return true;
}

void PathIntegrator::trace(Path& p) const {
  ++p.task->splats.rays;
  p.hit = tracer_.intersect({p.origin, p.direction},
                            p.task->stream.bits(dimension(p.bounces, kDirection) + (p.passes << 24)));
  if (p.hit.valid()) surfaces_.prefetch(p.hit.instance, p.hit.triangle);
}

// The point that was hit; false if the path ends there or has missed.
bool PathIntegrator::arrive(Path& p) const {
  const Hit& hit = p.hit;
  if (!hit.valid()) {
    p.sum += p.throughput * missed(p.direction, p.pdf, p.bounces);
    return false;
  }
  p.at = surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2);
  const SurfaceKind& kind = surfaces_.kind(hit.instance);
  p.distance += hit.t;
  if (max_component(p.absorption) > 0.0f)
    for (int k = 0; k < 3; ++k) p.throughput[k] *= exponential(-p.absorption[k] * hit.t);
  p.leaves = dot(p.direction, p.at.ng) > 0.0f;
  if (p.leaves) {  // a back face
    if (!kind.double_sided && !kind.glass) {
      if (p.bounces == 0) p.task->splats.inside = true;
      return false;
    }
    p.at.ng = -p.at.ng;
    p.at.ns = -p.at.ns;
  }
  if (kind.emissive && counts(p.bounces) && (!p.leaves || kind.double_sided))
    p.sum += p.throughput * emitted(p);
  if (!kind.glass && !may_reflect(p.bounces)) return false;
  if (kind.textured) prefetch_textures(*kind.material, p.at.attributes);
  return true;
}

// Does the path go straight on through glass? If not, its throughput makes up for those that do. To light
// sampling the glass is not there, so the vertex, and the density of the direction, stay.
bool PathIntegrator::passes_glass(Path& p, const Bsdf& layers) const {
  const float cos = std::abs(dot(p.direction, p.at.ng));
  const Vec3 through = straight_through(layers, cos);
  const float passed = luminance(through);
  if (!(passed > 0.0f)) return false;
  const float chance = passed / (passed + luminance(layers.diffuse) + luminance(fresnel(layers, cos)));
  const float u = unit_float(p.task->stream.bits(dimension(p.bounces, kLayer) + (p.passes << 24)));
  if (u >= chance) {
    p.throughput /= 1.0f - chance;
    return false;
  }
  p.throughput *= p.passes < kMostPasses ? through / chance : Vec3(0.0f);
  if (max_component(layers.absorption) > 0.0f) {
    // Where the path started inside, nothing was entered: the way to this exit is absorbed now.
    for (int k = 0; p.leaves && k < 3; ++k)
      if (p.absorption[k] < layers.absorption[k])
        p.throughput[k] *= exponential((p.absorption[k] - layers.absorption[k]) * p.hit.t);
    p.absorption = glm::max(p.absorption + (p.leaves ? -layers.absorption : layers.absorption), Vec3(0.0f));
  }
  p.origin = offset_origin(p.at.position, -p.at.ng, p.at.error);
  ++p.passes;
  return max_component(p.throughput) > 0.0f;
}

// Gathers light at the point and chooses where the path goes on, if it does.
bool PathIntegrator::continues(Path& p) const {
  SurfacePoint& at = p.at;
  const SampleStream& stream = p.task->stream;
  const uint32_t bounces = p.bounces + 1;
  if (surfaces_.kind(p.hit.instance).normal_map) {
    // The map belongs to the front; seen from behind its normals are turned round as a whole.
    const float side = p.leaves ? -1.0f : 1.0f;
    at.ng *= side, at.ns *= side;
    at.ns = surfaces_.mapped_normal(p.hit.instance, p.hit.triangle, at) * side;
    at.ng *= side;
  }
  if (dot(p.direction, at.ns) >= 0.0f) at.ns = at.ng;  // seen from below the shading horizon
  const Frame frame(at.ns);
  const SurfaceKind& kind = surfaces_.kind(p.hit.instance);
  const Bsdf layers = bsdf_at(*kind.material, at.attributes);
  if (kind.glass) {
    if (passes_glass(p, layers)) return true;
    if (!may_reflect(p.bounces)) return false;
  }
  const SeenBsdf bsdf(layers, frame.to_local(-p.direction));
  const Vertex vertex{at, &bsdf, frame};
  Vec3 reflected(0.0f);
  direct(vertex, stream, bounces, p.task->splats, &reflected);
  p.sum += p.throughput * reflected;

  const bool roulette = bounces >= kRouletteAfter;
  const Vec2 layer = roulette || bsdf.wants_layer() ? stream.pair(dimension(bounces, kLayer)) : Vec2(0.0f);
  const BsdfSample s = bsdf.sample(layer.x, stream.pair(dimension(bounces, kDirection)));
  if (!(max_component(s.weight) > 0.0f)) return false;
  p.direction = frame.to_world(s.direction);
  if (dot(p.direction, at.ng) <= 0.0f) return false;  // nothing leaks through the surface itself
  p.throughput *= s.weight;
  if (roulette) {
    const float survival = std::min(1.0f, max_component(p.throughput));
    if (layer.y >= survival) return false;
    p.throughput /= survival;
  }
  p.pdf = s.pdf;
  p.from = at.position;
  p.from_normal = at.ns;
  p.origin = vertex.origin();
  p.distance = 0.0f;
  p.bounces = bounces;
  p.passes = 0;
  return true;
}

void PathIntegrator::sample(std::span<Task> tasks) const {
  Path paths[kBatch];
  size_t live[kBatch];
  size_t count = 0;
  for (size_t i = 0; i < tasks.size(); ++i)
    if (start(paths[i], tasks[i])) live[count++] = i;
  const auto keep = [&](const auto& step) {
    size_t kept = 0;
    for (size_t k = 0; k < count; ++k) {
      Path& path = paths[live[k]];
      if (step(path)) {
        live[kept++] = live[k];
      } else if (!(max_component(path.sum) <= 0.0f)) {  // so that NaN passes: the film counts it
        path.task->splats.add(path.first_direction, path.sum / path.first_pdf);
      }
    }
    count = kept;
  };
  while (count) {
    for (size_t k = 0; k < count; ++k) trace(paths[live[k]]);
    keep([this](Path& p) { return arrive(p); });
    keep([this](Path& p) { return continues(p); });
  }
}

}  // namespace kiln
