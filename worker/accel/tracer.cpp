#include "worker/accel/tracer.h"

#include <map>

#include "common/base/format.h"
#include "common/math/sequence.h"
#include "common/math/trig.h"
#include "worker/accel/embree_api.h"

namespace kiln {
namespace {

bool processor_has(const std::string& isa) {
  if (isa == "sse2") return true;
  if (isa == "sse4.2") return __builtin_cpu_supports("sse4.2");
  if (isa == "avx") return __builtin_cpu_supports("avx");
  if (isa == "avx2") return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (isa == "avx512")
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  return false;
}

// What a filter needs of its ray; Embree hands the head back to us.
struct QueryContext {
  embree::Context head;
  uint32_t key = 0;
  Vec3 direction;       // unit; for glass
  float length = 1.0f;  // of the ray's own direction
  Vec3 transmittance{1.0f};
  // Of media: the sum of absorption x distance, entries counted negative, and absorption that was entered and
  // not left. No order of the surfaces is assumed: Embree meets them in any.
  Vec3 optical{0.0f}, inside{0.0f};
};

// Root geometry i is instance i: the id is the hit's own, or that of the instance it was met through.
uint32_t instance_of(const RTCFilterFunctionNArguments* args) {
  const unsigned through = RTCHitN_instID(args->hit, 1, 0, 0);
  return through != RTC_INVALID_GEOMETRY_ID ? through : RTCHitN_geomID(args->hit, 1, 0);
}

float opacity_of(const RTCFilterFunctionNArguments* args) {
  return static_cast<const Transparency*>(args->geometryUserPtr)
      ->opacity(instance_of(args), RTCHitN_primID(args->hit, 1, 0), RTCHitN_u(args->hit, 1, 0),
                RTCHitN_v(args->hit, 1, 0));
}

void filter_intersect(const RTCFilterFunctionNArguments* args) {
  const auto& context = *reinterpret_cast<const QueryContext*>(args->context);
  const float alpha = opacity_of(args);
  if (alpha >= 1.0f) return;
  const uint32_t hash =
      hash_combine(hash_combine(context.key, instance_of(args)), RTCHitN_primID(args->hit, 1, 0));
  if (alpha <= 0.0f || unit_float(hash) >= alpha) args->valid[0] = 0;
}

void filter_occluded(const RTCFilterFunctionNArguments* args) {
  auto& context = *reinterpret_cast<QueryContext*>(args->context);
  const float alpha = opacity_of(args);
  if (alpha >= 1.0f) return;
  context.transmittance *= 1.0f - std::max(alpha, 0.0f);
  args->valid[0] = 0;
}

void filter_glass(const RTCFilterFunctionNArguments* args) {
  auto& context = *reinterpret_cast<QueryContext*>(args->context);
  const auto& surface = *static_cast<const Transparency*>(args->geometryUserPtr);
  const uint32_t instance = instance_of(args), triangle = RTCHitN_primID(args->hit, 1, 0);
  const float b1 = RTCHitN_u(args->hit, 1, 0), b2 = RTCHitN_v(args->hit, 1, 0);
  const float alpha = surface.has_alpha(instance)
                          ? std::clamp(surface.opacity(instance, triangle, b1, b2), 0.0f, 1.0f)
                          : 1.0f;
  if (alpha > 0.0f) {
    const Transparency::Pass pass = surface.pass(instance, triangle, b1, b2, context.direction);
    const Vec3 share = Vec3(1.0f - alpha) + pass.factor * alpha;
    if (!(max_component(share) > 0.0f)) return;
    context.transmittance *= share;
    if (max_component(pass.absorption) > 0.0f) {
      const Vec3 depth = pass.absorption * (RTCRayN_tfar(args->ray, 1, 0) * context.length);
      context.optical += pass.enters ? -depth : depth;
      context.inside += pass.enters ? pass.absorption : -pass.absorption;
    }
  }
  args->valid[0] = 0;
}

class EmbreeTracer final : public Tracer {
 public:
  ~EmbreeTracer() override {
    for (RTCScene scene : children_) rtcReleaseScene(scene);
    if (root_) rtcReleaseScene(root_);
    if (device_) rtcReleaseDevice(device_);
  }

  Status build(const Scene& scene, const Transparency& surface, const std::string& isa, unsigned threads);

  Hit intersect(const Ray& ray, uint32_t key) const override {
    QueryContext context;
    embree::init(context.head);
    context.key = key;
    RTCRayHit q;
    fill(q.ray, ray);
    q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embree::intersect(root_, context.head, q);
    Hit hit;
    if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
    const unsigned id = q.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? q.hit.instID[0] : q.hit.geomID;
    return {id, q.hit.primID, q.hit.u, q.hit.v, q.ray.tfar};
  }

  Vec3 transmittance(const Ray& ray) const override {
    QueryContext context;
    embree::init(context.head);
    if (glass_) {
      context.length = length(ray.direction);
      context.direction = ray.direction / context.length;
    }
    RTCRay q;
    fill(q, ray);
    embree::occluded(root_, context.head, q);
    if (q.tfar < 0.0f) return Vec3(0.0f);
    return glass_ ? through_media(context, ray.far * context.length) : context.transmittance;
  }

  size_t memory_bytes() const override { return static_cast<size_t>(memory_); }

 private:
  static void fill(RTCRay& q, const Ray& ray) {
    q.org_x = ray.origin.x, q.org_y = ray.origin.y, q.org_z = ray.origin.z;
    q.dir_x = ray.direction.x, q.dir_y = ray.direction.y, q.dir_z = ray.direction.z;
    q.tnear = 0.0f, q.tfar = ray.far, q.time = 0.0f;
    q.mask = ~0u, q.id = 0, q.flags = 0;
  }
  // What passes media, of which those that were not left reach to the ray's end.
  static Vec3 through_media(const QueryContext& c, float end) {
    Vec3 passed = c.transmittance;
    for (int k = 0; k < 3; ++k) {
      const float left_open = c.inside[k] > 0.0f ? c.inside[k] * end : 0.0f;
      passed[k] *= exponential(-std::max(0.0f, c.optical[k] + left_open));
    }
    return passed;
  }
  // Which filters a geometry has.
  struct Filters {
    const Transparency* surface = nullptr;
    bool alpha = false, glass = false;
    auto operator<=>(const Filters&) const = default;
  };
  RTCGeometry triangles(const Mesh& mesh, const Mat4x3* to_world, const Filters& filters);
  RTCScene child(const Mesh& mesh, const Filters& filters);

  RTCDevice device_ = nullptr;
  RTCScene root_ = nullptr;
  std::vector<RTCScene> children_;
  bool glass_ = false;
  ssize_t memory_ = 0;
};

RTCGeometry EmbreeTracer::triangles(const Mesh& mesh, const Mat4x3* to_world, const Filters& filters) {
  RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* p = static_cast<Vec3*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                       sizeof(Vec3), mesh.positions.size()));
  auto* t = static_cast<UVec3*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                        sizeof(UVec3), mesh.triangles.size()));
  if (p && t) {
    for (size_t i = 0; i < mesh.positions.size(); ++i)
      p[i] = to_world ? transform_point(*to_world, mesh.positions[i]) : mesh.positions[i];
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), t);
  }
  rtcSetGeometryUserData(g, const_cast<Transparency*>(filters.surface));
  if (filters.alpha) rtcSetGeometryIntersectFilterFunction(g, filter_intersect);
  if (filters.alpha || filters.glass)
    rtcSetGeometryOccludedFilterFunction(g, filters.glass ? filter_glass : filter_occluded);
  rtcCommitGeometry(g);
  return g;
}

RTCScene EmbreeTracer::child(const Mesh& mesh, const Filters& filters) {
  RTCScene scene = rtcNewScene(device_);
  RTCGeometry g = triangles(mesh, nullptr, filters);
  rtcAttachGeometry(scene, g);
  rtcReleaseGeometry(g);
  rtcCommitScene(scene);
  children_.push_back(scene);
  return scene;
}

Status EmbreeTracer::build(const Scene& scene, const Transparency& surface, const std::string& isa,
                           unsigned threads) {
  if (!processor_has(isa))
    return fail(
        ErrorKind::kInvalidInput,
        text("this processor has no {}: bake with another numeric class (--isa), or on another machine",
             isa));
  device_ = rtcNewDevice(text("isa={},threads={},set_affinity=0", isa, threads).c_str());
  if (!device_) return fail(ErrorKind::kInternal, "Embree could not be started");
  rtcSetDeviceMemoryMonitorFunction(
      device_,
      [](void* self, ssize_t bytes, bool) {
        __atomic_add_fetch(&static_cast<EmbreeTracer*>(self)->memory_, bytes, __ATOMIC_RELAXED);
        return true;
      },
      this);
  std::vector<uint32_t> uses(scene.meshes.size(), 0);
  for (const Instance& i : scene.instances) ++uses[i.mesh];

  root_ = rtcNewScene(device_);
  std::map<std::pair<uint32_t, Filters>, RTCScene> shared;  // by mesh and how it is filtered
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const Mesh& mesh = scene.meshes[instance.mesh];
    const Filters filters{&surface, surface.has_alpha(i), surface.is_glass(i)};
    glass_ = glass_ || filters.glass;
    RTCGeometry g;
    if (uses[instance.mesh] == 1) {
      g = triangles(mesh, &instance.to_world, filters);
    } else {
      RTCScene& target = shared[{instance.mesh, filters}];
      if (!target) target = child(mesh, filters);
      g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(g, target);
      rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &instance.to_world[0][0]);
      rtcCommitGeometry(g);
    }
    rtcAttachGeometryByID(root_, g, i);
    rtcReleaseGeometry(g);
  }
  rtcCommitScene(root_);
  if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
    return fail(error == RTC_ERROR_OUT_OF_MEMORY ? ErrorKind::kNoSpace : ErrorKind::kInternal,
                text("Embree could not build the scene (error {}); {} MiB were in use",
                     static_cast<int>(error), memory_ >> 20));
  return {};
}

}  // namespace

Expected<std::unique_ptr<Tracer>> Tracer::create(const Scene& scene, const Transparency& transparency,
                                                 const std::string& isa, unsigned threads) {
  auto tracer = std::make_unique<EmbreeTracer>();
  KILN_TRY_STATUS(tracer->build(scene, transparency, isa, threads));
  return std::unique_ptr<Tracer>(std::move(tracer));
}

}  // namespace kiln
