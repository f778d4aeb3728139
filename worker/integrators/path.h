// The path tracer behind Integrator, as a template over the features (integrator.h) it is compiled
// for. A batch of samples advances stage by stage; all have made the same number of reflections.
#pragma once

#include <limits>

#include "common/math/frame.h"
#include "common/math/sequence_batch.h"
#include "common/math/trig.h"
#include "common/math/warp.h"
#include "worker/integrators/dimensions.h"
#include "worker/integrators/integrator.h"

namespace kiln {

constexpr uint32_t kMaxPasses = 64;     // glass surfaces between two vertices; light beyond the last is lost
constexpr uint32_t kRouletteAfter = 3;  // every path may make this many reflections

template <uint32_t kFeatures>
class PathIntegrator final : public Integrator {
 public:
  PathIntegrator(const Surfaces& surfaces, const Tracer& tracer, const Lights& lights,
                 const TransportSettings& settings)
      : surfaces_(surfaces), tracer_(tracer), lights_(lights), settings_(settings) {}
  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<Wave>(); }
  void sample(std::span<Task> tasks, Workspace& workspace, const KnownIrradiance* known) const override;

 private:
  static constexpr bool has(Feature f) { return kFeatures & f; }
  static_assert(!has(kAreaLights) || has(kLocalLights));
  static constexpr int kStrategies = has(kLocalLights) + has(kSuns) + has(kSkyImage);
  // A path keeps its previous vertex where emitters need it for MIS. The vertex after b reflections
  // is stored at b mod kVertices.
  static constexpr uint32_t kVertices = has(kLocalLights) ? 2 : 1;
  static constexpr uint32_t slot(uint32_t bounces) { return bounces % kVertices; }
  using Seen = std::conditional_t<has(kLayers), BsdfAtWo, LambertAtWo>;

  // State of a ray that passes through glass, since its last vertex.
  struct Glass {
    float distance;   // travelled
    Vec3 absorption;  // absorption of the medium the ray is in
    uint32_t passes;
  };
  struct NoGlass {};

  // A path in flight. It gathers light at its vertex: either the texel itself, which may record any linear
  // functional of the incident light and draws directions from the mixed hemisphere, or a reflecting point.
  struct Path {
    SurfacePoint vertices[kVertices];
    Frame frame{Vec3(0, 0, 1)};  // around the shading normal
    Seen bsdf;                   // at a reflecting vertex
    Vec3 origin, direction;      // ray origin (offset, and behind any glass passed) and direction
    float pdf;                   // density of the direction
    Vec3 throughput, sum;        // path throughput, and radiance gathered so far
    Vec3 direct, hidden;  // radiance straight from emitters: in `sum`, and of those that texels do not see
    Vec3 first_direction;
    float first_pdf;
    float drawn[kCacheDraws];  // errors drawn of the known irradiance that is in `sum`, their luminance
    // At a vertex whose irradiance is known:
    bool share_taken;        // the closure is built already, less the Lambert lobe lit by that irradiance
    bool reflected_known;    // the irradiance lacks direct light, which the path still has to gather
    Vec3 throughput_beyond;  // if reflected_known: factor of the throughput past the next surface's emission
    Hit hit;
    [[no_unique_address]] std::conditional_t<has(kGlass), Glass, NoGlass> glass;
  };
  // A light sample whose shadow ray has not been traced yet.
  struct Shadow {
    Vec3 direction, contribution;
    uint32_t path;
    Arriving how;
  };

  // The batch. `live` lists the paths still in flight.
  struct Wave final : Workspace {
    std::span<Task> tasks;
    const KnownIrradiance* known;
    Path paths[kBatch];
    uint32_t live[kBatch];
    size_t count = 0;
    SampleBatch samples;
    float u[2][kBatch], v[2][kBatch];  // random numbers of live paths, indexed as `live`
    Ray rays[kBatch * std::max(1, kStrategies)];
    Shadow shadows[kBatch * std::max(1, kStrategies)];
    Vec3 passed[kBatch * std::max(1, kStrategies)];
    size_t shadow_count = 0;
    LightSample sky[has(kSkyImage) ? kBatch : 1];
  };
  enum class Arrival { kEnds, kReflects, kPasses };

  void start(Wave& w) const;
  template <bool kTexel>
  void gather(Wave& w, uint32_t bounces) const;
  template <bool kTexel>
  void queue_shadow_ray(Wave& w, uint32_t i, uint32_t bounces, const LightSample& s) const;
  template <bool kTexel>
  void trace_shadows(Wave& w) const;
  void leave_texel(Wave& w) const;
  void trace(Wave& w, uint32_t bounces) const;
  Arrival arrive(Path& p, Task& task, const KnownIrradiance* known, uint32_t bounces) const;
  bool ends_at_known(Path& p, const Task& task, const KnownIrradiance& known, const Vec3* irradiance,
                     uint32_t bounces) const;
  bool passes_glass(Path& p, const SurfacePoint& at, const Bsdf& layers, bool leaves, Task& task,
                    uint32_t bounces) const;
  void make_bsdf(Path& p, uint32_t bounces) const;
  void reflect(Wave& w, uint32_t bounces) const;
  void finish(Wave& w, uint32_t i) const;
  // Radiance of the emissive surface hit or of the environment, MIS-weighted against light sampling.
  Vec3 emitted(const Path& p, const SurfacePoint& at, uint32_t bounces) const;
  Vec3 missed(const Path& p, uint32_t bounces) const;
  // Adds the radiance of area lights that the ray crosses before the hit, with the same MIS weights.
  void add_crossed(Path& p, uint32_t bounces) const;

  // Balance heuristic for density `pdf` against `other`. With a single strategy forced, light that
  // the other strategy cannot find still counts.
  float mis_weight(MisMode own, float pdf, float other) const {
    if constexpr (has(kOneStrategy))
      if (settings_.mis_mode != MisMode::kBoth && other > 0.0f)
        return settings_.mis_mode == own ? 1.0f : 0.0f;
    return pdf / (pdf + other);
  }

  static void draw(const Wave& w, uint32_t dimension, float (&out)[2][kBatch]) {
    w.samples.pairs(dimension, w.live, w.count, out[0], out[1]);
  }
  static void draw_singles(const Wave& w, uint32_t dimension, float (&out)[2][kBatch]) {
    w.samples.singles(dimension, w.live, w.count, out[0]);
  }
  static Vec2 pair(const float (&numbers)[2][kBatch], size_t k) { return {numbers[0][k], numbers[1][k]}; }
  bool may_reflect(uint32_t bounces) const { return settings_.indirect && bounces < settings_.max_bounces; }
  // Whether a throughput or contribution is not zero. A closure less its Lambert lobe may be negative.
  static bool is_light(const Vec3& v) {
    if constexpr (has(kLayers)) return v != Vec3(0.0f);
    return max_component(v) > 0.0f;
  }
  static float magnitude(const Vec3& v) {
    if constexpr (has(kLayers)) return max_component(glm::abs(v));
    return max_component(v);
  }
  // Adds light that was reflected so often since it left an emitter; `hidden`: texels do not see that one.
  void gather_along(Path& p, uint32_t bounces, bool hidden, const Vec3& light) const {
    (bounces == 0 && hidden ? p.hidden : p.sum) += light;
    if (bounces == 0 && settings_.quantities.direct_apart && !hidden) p.direct += light;
  }
  // Whether a texel takes light straight from an emitter.
  bool takes(bool hidden) const { return !hidden || settings_.quantities.all_light; }
  // Whether light that was reflected this often is part of the result.
  bool counts(uint32_t bounces) const { return bounces == 0 ? settings_.direct : settings_.indirect; }

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  const Lights& lights_;
  const TransportSettings settings_;
};

template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::start(Wave& w) const {
  for (uint32_t i = 0; i < w.tasks.size(); ++i) {
    Path& p = w.paths[i];
    const SurfacePoint& receiver = w.tasks[i].receiver;
    SurfacePoint& at = p.vertices[0];  // its material is not read
    at.position = receiver.position;
    at.ng = receiver.ng;
    at.ns = receiver.ns;
    at.error = receiver.error;
    p.frame = Frame(at.ns);
    p.origin = offset_origin(at.position, at.ng, at.error);
    p.throughput = Vec3(1.0f);
    p.sum = p.direct = p.hidden = Vec3(0.0f);
    p.reflected_known = false;
    if (settings_.quantities.cache_draws) std::fill_n(p.drawn, kCacheDraws, 0.0f);
    if constexpr (has(kGlass)) p.glass = {0.0f, Vec3(0.0f), 0};
    w.samples.add(w.tasks[i].stream);
    w.live[i] = i;
  }
  w.count = w.tasks.size();
}

// Queues a shadow ray unless the contribution is zero.
template <uint32_t kFeatures>
template <bool kTexel>
void PathIntegrator<kFeatures>::queue_shadow_ray(Wave& w, uint32_t i, uint32_t bounces,
                                                 const LightSample& s) const {
  if (!(max_component(s.weight) > 0.0f) || (kTexel && !takes(s.indirect_only))) return;
  const Path& p = w.paths[i];
  const SurfacePoint& vertex = p.vertices[slot(bounces)];
  const Vec3 local = p.frame.to_local(s.direction);
  if (local.z <= 0.0f || dot(s.direction, vertex.ng) <= 0.0f) return;
  Vec3 contribution = s.weight;
  float direction_pdf = 0.0f;
  if constexpr (kTexel) {
    direction_pdf = primary_pdf(settings_.primary, local.z);
  } else {
    const BsdfValue value = p.bsdf.value(local);
    contribution *= value.f * local.z;
    if (!is_light(contribution)) return;
    direction_pdf = value.pdf;
  }
  if (s.pdf > 0.0f) contribution *= mis_weight(MisMode::kLights, s.pdf, direction_pdf);
  Ray& ray = w.rays[w.shadow_count];
  ray.origin = p.origin;
  ray.direction = s.far ? s.direction : vertex.position + s.segment - p.origin;
  ray.far = s.far ? Ray().far : 1.0f;
  Shadow& shadow = w.shadows[w.shadow_count++];
  shadow.direction = s.direction;
  shadow.contribution = contribution;
  shadow.path = i;
  shadow.how = s.indirect_only ? Arriving::kHidden : Arriving::kDirect;  // read at texels alone
}

// Adds direct light at the vertices.
template <uint32_t kFeatures>
template <bool kTexel>
void PathIntegrator<kFeatures>::gather(Wave& w, uint32_t bounces) const {
  if constexpr (kStrategies > 0) {
    w.shadow_count = 0;
    if constexpr (has(kLocalLights)) {
      const LocalLights& local = lights_.local;
      if (!local.empty()) {
        if (local.wants_choice()) draw_singles(w, dimension(bounces, kLocalLight), w.u);
        if (local.wants_point()) draw(w, dimension(bounces, kLocalPoint), w.v);
        for (size_t k = 0; k < w.count; ++k) {
          const SurfacePoint& at = w.paths[w.live[k]].vertices[slot(bounces)];
          queue_shadow_ray<kTexel>(w, w.live[k], bounces,
                                   local.sample(surfaces_, at.position, at.ns, w.u[0][k], pair(w.v, k)));
        }
      }
    }
    if constexpr (has(kSuns)) {
      const DirectionalLights& suns = lights_.directional;
      if (!suns.empty()) {
        if (suns.wants_choice()) draw_singles(w, dimension(bounces, kSun), w.u);
        if (suns.wants_point()) draw(w, dimension(bounces, kSunPoint), w.v);
        for (size_t k = 0; k < w.count; ++k)
          if (suns.may_light(w.paths[w.live[k]].vertices[slot(bounces)].ns))
            queue_shadow_ray<kTexel>(w, w.live[k], bounces, suns.sample(w.u[0][k], pair(w.v, k)));
      }
    }
    if constexpr (has(kSkyImage)) {
      if (lights_.environment.wants_sampling()) {
        draw(w, dimension(bounces, kEnvironment), w.u);
        lights_.environment.sample(w.u[0], w.u[1], w.count, w.sky);
        for (size_t k = 0; k < w.count; ++k) queue_shadow_ray<kTexel>(w, w.live[k], bounces, w.sky[k]);
      }
    }
    trace_shadows<kTexel>(w);
  }
}

template <uint32_t kFeatures>
template <bool kTexel>
void PathIntegrator<kFeatures>::trace_shadows(Wave& w) const {
  tracer_.transmittance(std::span(w.rays, w.shadow_count), w.passed);
  for (size_t k = 0; k < w.shadow_count; ++k) {
    const Shadow& s = w.shadows[k];
    RadianceSamples& radiance = w.tasks[s.path].radiance;
    ++radiance.rays;
    if (!(max_component(w.passed[k]) > 0.0f)) continue;
    if constexpr (kTexel) {
      radiance.add(s.direction, s.contribution * w.passed[k], s.how);
    } else {
      Path& p = w.paths[s.path];
      p.sum += p.throughput * (s.contribution * w.passed[k]);
    }
  }
}

template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::leave_texel(Wave& w) const {
  draw(w, dimension(0, kDirection), w.u);
  const bool responds = !settings_.quantities.responses.empty() || settings_.quantities.probes;
  size_t kept = 0;
  for (size_t k = 0; k < w.count; ++k) {
    Path& p = w.paths[w.live[k]];
    const Vec3 local = primary_direction(settings_.primary, pair(w.u, k));
    p.direction = p.first_direction = p.frame.to_world(local);
    p.pdf = p.first_pdf = primary_pdf(settings_.primary, local.z);
    const bool above = dot(p.direction, p.vertices[0].ng) > 0.0f;
    if (responds) {
      PrimaryRay& primary = w.tasks[w.live[k]].radiance.primary;
      primary.direction = p.direction;
      primary.weight = above ? primary_weight(local.z, p.pdf) : 0.0f;
    }
    // Directions below the geometric horizon receive no light.
    if (above) w.live[kept++] = w.live[k];
  }
  w.count = kept;
}

template <uint32_t kFeatures>
Vec3 PathIntegrator<kFeatures>::emitted(const Path& p, const SurfacePoint& at, uint32_t bounces) const {
  const SurfacePoint& vertex = p.vertices[slot(bounces)];
  const Vec3 emission = emission_at(*surfaces_.kind(p.hit.instance).material, at.attributes);
  if (!(max_component(emission) > 0.0f)) return Vec3(0.0f);
  float distance = p.hit.t;
  if constexpr (has(kGlass)) distance = p.glass.distance;
  const float other = lights_.local.pdf(vertex.position, vertex.ns, p.hit.instance, p.hit.triangle,
                                        std::abs(dot(p.direction, at.ng)), distance);
  return emission * mis_weight(MisMode::kPaths, p.pdf, other);
}

template <uint32_t kFeatures>
Vec3 PathIntegrator<kFeatures>::missed(const Path& p, uint32_t bounces) const {
  const Environment& environment = lights_.environment;
  if (!counts(bounces) || environment.is_black() || (bounces == 0 && !takes(environment.indirect_only())))
    return Vec3(0.0f);
  if constexpr (has(kSkyImage)) {
    const uint32_t texel = p.hit.triangle;  // put there by trace()
    return environment.radiance(texel) * mis_weight(MisMode::kPaths, p.pdf, environment.pdf(texel));
  }
  return environment.radiance(p.direction);
}

template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::add_crossed(Path& p, uint32_t bounces) const {
  if (!counts(bounces)) return;
  const SurfacePoint& vertex = p.vertices[slot(bounces)];
  // The offset of the first ray may put its origin behind a light that the vertex is in front of.
  double from = -std::numeric_limits<double>::infinity();
  if constexpr (has(kGlass))
    if (p.glass.passes > 0) from = 0.0;
  const double to = p.hit.valid() ? p.hit.t : std::numeric_limits<double>::infinity();
  const auto take = [&](const LocalLights::Crossing& c) {
    if (bounces == 0 && !takes(c.indirect_only)) return;
    Vec3 light = c.radiance * mis_weight(MisMode::kPaths, p.pdf, c.pdf);
    if constexpr (has(kGlass)) {
      const auto inside = static_cast<float>(std::max(c.distance, 0.0));
      for (int k = 0; k < 3; ++k) light[k] *= exponential(-p.glass.absorption[k] * inside);
    }
    gather_along(p, bounces, c.indirect_only, p.throughput * light);
  };
  lights_.local.for_each_crossing(vertex.position, vertex.ns, {p.origin, p.direction, from, to}, take);
}

// Advances every live path to its next reflecting surface; `live` keeps those that may reflect there.
template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::trace(Wave& w, uint32_t bounces) const {
  size_t kept = 0;
  uint32_t todo[kBatch];
  size_t left = w.count;
  std::copy_n(w.live, left, todo);
  while (left) {
    for (size_t k = 0; k < left; ++k) {
      Path& p = w.paths[todo[k]];
      Task& task = w.tasks[todo[k]];
      uint32_t key = dimension(bounces, kDirection);
      if constexpr (has(kGlass)) key += p.glass.passes << 24;
      ++task.radiance.rays;
      ::new (&p.hit) Hit(tracer_.intersect({p.origin, p.direction}, task.stream.bits(key)));
      if (p.hit.valid()) {
        surfaces_.prefetch(p.hit.instance, p.hit.triangle);
      } else if (has(kSkyImage) && lights_.environment.wants_sampling()) {
        p.hit.triangle = lights_.environment.texel_of(p.direction);
        lights_.environment.prefetch(p.hit.triangle);
      }
    }
    size_t again = 0;
    for (size_t k = 0; k < left; ++k) {
      const uint32_t i = todo[k];
      if constexpr (has(kAreaLights)) add_crossed(w.paths[i], bounces);
      const Arrival arrival = arrive(w.paths[i], w.tasks[i], w.known, bounces);
      if (arrival == Arrival::kReflects)
        w.live[kept++] = i;
      else if (has(kGlass) && arrival == Arrival::kPasses)
        todo[again++] = i;
      else
        finish(w, i);
    }
    left = again;
  }
  w.count = kept;
}

// Handles the hit; a reflecting surface becomes the path's vertex.
template <uint32_t kFeatures>
auto PathIntegrator<kFeatures>::arrive(Path& p, Task& task, const KnownIrradiance* known,
                                       uint32_t bounces) const -> Arrival {
  const Hit& hit = p.hit;
  PrimaryRay& primary = task.radiance.primary;
  if constexpr (has(kGlass))
    if (bounces == 0) primary.transmittance = luminance(p.throughput);
  if (!hit.valid()) {
    gather_along(p, bounces, lights_.environment.indirect_only(), p.throughput * missed(p, bounces));
    return Arrival::kEnds;
  }
  const SurfaceKind& kind = surfaces_.kind(hit.instance);
  SurfacePoint& at = p.vertices[slot(bounces + 1)];
  surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2, at);
  // The normal map belongs to the front; seen from behind, all its normals are flipped.
  bool agrees = true;
  if (kind.normal_map && may_reflect(bounces)) {
    const Vec3 smooth = at.ns;
    at.ns = surfaces_.mapped_normal(hit.instance, hit.triangle, at);
    agrees = dot(smooth, at.ns) > KnownIrradiance::kMinAgreement;
  }
  if constexpr (has(kGlass)) {
    p.glass.distance += hit.t;
    if (max_component(p.glass.absorption) > 0.0f)
      for (int k = 0; k < 3; ++k) p.throughput[k] *= exponential(-p.glass.absorption[k] * hit.t);
  }
  if (bounces == 0) primary.distance = hit.t;
  if constexpr (has(kGlass))
    if (bounces == 0) primary.distance = p.glass.distance;
  const bool leaves = dot(p.direction, at.ng) > 0.0f;  // a back face
  if (leaves) {
    if (!kind.double_sided && !kind.glass) {
      if (bounces == 0) task.radiance.inside = true;
      return Arrival::kEnds;
    }
    at.ng = -at.ng;
    at.ns = -at.ns;
  }
  if (kind.emissive && counts(bounces) && (!leaves || kind.double_sided))
    gather_along(p, bounces, false, p.throughput * emitted(p, at, bounces));
  if (kind.textured) prefetch_textures(*kind.material, at.attributes);
  if constexpr (has(kGlass)) {
    if (kind.glass && passes_glass(p, at, bsdf_at(*kind.material, at.attributes), leaves, task, bounces)) {
      if (bounces == 0) primary.distance = PrimaryRay{}.distance;
      return Arrival::kPasses;
    }
    p.glass = {0.0f, p.glass.absorption, 0};
  }
  if (p.reflected_known) {
    p.throughput *= p.throughput_beyond;
    p.reflected_known = false;
    if (!is_light(p.throughput)) return Arrival::kEnds;
  }
  if (!may_reflect(bounces)) return Arrival::kEnds;
  p.share_taken = false;
  if (known && agrees && !leaves && !kind.glass)
    if (const Vec3* irradiance = known->find(hit);
        irradiance && ends_at_known(p, task, *known, irradiance, bounces))
      return Arrival::kEnds;
  return Arrival::kReflects;
}

// Adds what a Lambert lobe reflects of the vertex's known irradiance, and returns whether the path ends. The
// lobe is the closure's own, or the one that stands for the lobes below its layers. The rest of the closure,
// its difference from that lobe, is sampled by a fraction of the paths, divided by their probability, so the
// expected value is that of complete paths for every closure. Without direct light in the settings the known
// irradiance has reflected light alone: the path gathers direct light at the vertex and with one more ray.
template <uint32_t kFeatures>
bool PathIntegrator<kFeatures>::ends_at_known(Path& p, const Task& task, const KnownIrradiance& known,
                                              const Vec3* irradiance, uint32_t bounces) const {
  SurfacePoint& at = p.vertices[slot(bounces + 1)];
  const SurfaceKind& kind = surfaces_.kind(p.hit.instance);
  const auto take = [&](const Vec3& share) {
    const Vec3 reflected = p.throughput * share * kInvPi;
    p.sum += reflected * *irradiance;
    if (!settings_.quantities.cache_draws) return;
    const CacheDraws draws = known.draws(irradiance);
    for (size_t k = 0; k < kCacheDraws; ++k) p.drawn[k] += luminance(reflected) * draws[k];
  };
  if constexpr (!has(kLayers)) {
    take(albedo_at(*kind.material, at.attributes));
    p.reflected_known = !settings_.direct;
    return settings_.direct;
  } else {
    // Most paths end: the frame and the sampling of the closure are made for the others alone.
    at.see_along(p.direction);
    ::new (&p.bsdf.layers()) Bsdf(bsdf_at(*kind.material, at.attributes));
    p.bsdf.set_cosine(-dot(p.direction, at.ns));
    const Vec3 share = p.bsdf.lambert_share();
    if (!(max_component(share) > 0.0f)) return false;
    take(share);
    if (!settings_.direct) {
      p.reflected_known = true;
      return false;
    }
    const float chance = p.bsdf.chance_of_rest();
    const float u = unit_float(task.stream.bits(dimension(bounces + 1, kLayer) | 1u << 31));
    if (!(u < chance)) return true;
    p.throughput /= chance;
    p.frame = Frame(at.ns);
    p.bsdf.set_direction(p.frame.to_local(-p.direction));
    p.bsdf.take_lambert_share();
    p.share_taken = true;
    return false;
  }
}

// Builds the closure at the vertex.
template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::make_bsdf(Path& p, uint32_t bounces) const {
  SurfacePoint& at = p.vertices[slot(bounces)];
  at.see_along(p.direction);
  p.frame = Frame(at.ns);
  const Material& material = *surfaces_.kind(p.hit.instance).material;
  const Vec3 wo = p.frame.to_local(-p.direction);
  if constexpr (has(kLayers))
    ::new (&p.bsdf.layers()) Bsdf(bsdf_at(material, at.attributes)), p.bsdf.set_wo(wo);
  else
    p.bsdf = LambertAtWo(albedo_at(material, at.attributes), wo);
}

// Decides whether the path goes straight on through glass; the throughput accounts for the choice.
// Light sampling ignores the glass, so the vertex and the density of the direction stay the same.
template <uint32_t kFeatures>
bool PathIntegrator<kFeatures>::passes_glass(Path& p, const SurfacePoint& at, const Bsdf& layers, bool leaves,
                                             Task& task, uint32_t bounces) const {
  if constexpr (has(kGlass)) {
    const float cos = std::abs(dot(p.direction, at.ng));
    const Vec3 through = straight_through(layers, cos);
    const float passed = luminance(through);
    if (!(passed > 0.0f)) return false;
    const float chance = passed / (passed + luminance(layers.diffuse) + luminance(fresnel(layers, cos)));
    const float u = unit_float(task.stream.bits(dimension(bounces, kLayer) + (p.glass.passes << 24)));
    if (u >= chance) {
      p.throughput /= 1.0f - chance;
      return false;
    }
    p.throughput *= p.glass.passes < kMaxPasses ? through / chance : Vec3(0.0f);
    if (max_component(layers.absorption) > 0.0f) {
      Vec3& medium = p.glass.absorption;
      // A path that started inside has not entered: absorb along the way to this exit now.
      for (int k = 0; leaves && k < 3; ++k)
        p.throughput[k] *= exponential(std::min(0.0f, medium[k] - layers.absorption[k]) * p.hit.t);
      medium = glm::max(medium + (leaves ? -layers.absorption : layers.absorption), Vec3(0.0f));
    }
    p.origin = offset_origin(at.position, -at.ng, at.error);
    ++p.glass.passes;
    return is_light(p.throughput);
  }
  return false;
}

// Gathers light at the vertices and samples the next directions, if any. `bounces` counts the
// reflection there.
template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::reflect(Wave& w, uint32_t bounces) const {
  for (size_t k = 0; k < w.count; ++k) {
    Path& p = w.paths[w.live[k]];
    const SurfacePoint& at = p.vertices[slot(bounces)];
    if (!p.share_taken) make_bsdf(p, bounces);
    p.origin = offset_origin(at.position, at.ng, at.error);
  }
  gather<false>(w, bounces);

  const bool roulette = bounces >= kRouletteAfter;
  if (roulette || has(kLayers)) draw(w, dimension(bounces, kLayer), w.u);
  draw(w, dimension(bounces, kDirection), w.v);
  size_t kept = 0;
  for (size_t k = 0; k < w.count; ++k) {
    const uint32_t i = w.live[k];
    Path& p = w.paths[i];
    const BsdfSample s = p.bsdf.sample(w.u[0][k], pair(w.v, k));
    p.direction = p.frame.to_world(s.direction);
    p.pdf = s.pdf;
    p.throughput *= s.weight;
    if (p.reflected_known) p.throughput_beyond = p.bsdf.rest_of_share(s.direction);
    // Light must not leak through the surface itself.
    bool goes_on = is_light(p.throughput) && dot(p.direction, p.vertices[slot(bounces)].ng) > 0.0f;
    if (roulette && goes_on) {
      const float survival = std::min(1.0f, magnitude(p.throughput));
      goes_on = w.u[1][k] < survival;
      p.throughput /= survival;
    }
    if (goes_on)
      w.live[kept++] = i;
    else
      finish(w, i);
  }
  w.count = kept;
}

template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::finish(Wave& w, uint32_t i) const {
  const Path& p = w.paths[i];
  const auto add = [&](const Vec3& sum, Arriving how) {
    if (sum != Vec3(0.0f))  // so that NaN passes: the film counts it
      w.tasks[i].radiance.add(p.first_direction, sum / p.first_pdf, how);
  };
  add(p.sum, Arriving::kAlongPath);
  if (settings_.quantities.direct_apart) add(p.direct, Arriving::kDirectShare);
  if (settings_.quantities.all_light) add(p.hidden, Arriving::kHidden);
  if (settings_.quantities.cache_draws) {
    RadianceSamples& radiance = w.tasks[i].radiance;
    radiance.drawn_direction = p.first_direction;
    for (size_t k = 0; k < kCacheDraws; ++k) radiance.drawn[k] = p.drawn[k] / p.first_pdf;
  }
}

template <uint32_t kFeatures>
void PathIntegrator<kFeatures>::sample(std::span<Task> tasks, Workspace& workspace,
                                       const KnownIrradiance* known) const {
  auto& w = static_cast<Wave&>(workspace);
  w.known = known;
  w.tasks = tasks;
  w.samples.clear();
  start(w);
  if (settings_.direct) gather<true>(w, 0);
  leave_texel(w);
  for (uint32_t bounces = 0; w.count; ++bounces) {
    trace(w, bounces);
    if (w.count) reflect(w, bounces + 1);
  }
}

}  // namespace kiln
