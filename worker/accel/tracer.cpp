#include "worker/accel/tracer.h"

#include <array>
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

// Per-ray data for filters, indexed by ray id; Embree passes the head back to us.
struct QueryContext {
  embree::Context head;
  uint32_t key = 0;               // paths: of the one ray
  Vec3* passed = nullptr;         // shadow rays
  struct Glass* glass = nullptr;  // shadow rays of scenes with glass
};

// A shadow ray passing through glass. `optical` sums absorption x distance, negative at entries; `inside` is
// the absorption of media entered and not left. Does not assume an order, because Embree reports hits in any.
struct Glass {
  Vec3 direction;  // unit
  float length;    // of the ray's own direction
  Vec3 optical{0.0f}, inside{0.0f};

  // Transmittance of the media; those not left extend to the ray's end.
  Vec3 transmittance(float end) const {
    Vec3 passed;
    for (int k = 0; k < 3; ++k) {
      const float left_open = inside[k] > 0.0f ? inside[k] * end : 0.0f;
      passed[k] = exponential(-std::max(0.0f, optical[k] + left_open));
    }
    return passed;
  }
};

// One ray of the packet passed to a filter, and its candidate hit.
struct Candidate {
  const Transparency& surface;
  uint32_t instance, triangle;
  float b1, b2;

  // Root geometry i is instance i: the id is the hit's own, or that of the instance above it.
  Candidate(const RTCFilterFunctionNArguments* a, unsigned i)
      : surface(*static_cast<const Transparency*>(a->geometryUserPtr)),
        instance(RTCHitN_instID(a->hit, a->N, i, 0)),
        triangle(RTCHitN_primID(a->hit, a->N, i)),
        b1(RTCHitN_u(a->hit, a->N, i)),
        b2(RTCHitN_v(a->hit, a->N, i)) {
    if (instance == RTC_INVALID_GEOMETRY_ID) instance = RTCHitN_geomID(a->hit, a->N, i);
  }
  float opacity() const { return surface.opacity(instance, triangle, b1, b2); }
};

// Calls keep(candidate, i) for every ray of the packet; false: the ray continues through the surface.
template <class Keep>
void filter(const RTCFilterFunctionNArguments* args, const Keep& keep) {
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] == -1 && !keep(Candidate(args, i), i)) args->valid[i] = 0;
}

void filter_intersect(const RTCFilterFunctionNArguments* args) {
  const auto& context = *reinterpret_cast<const QueryContext*>(args->context);
  filter(args, [&](const Candidate& c, unsigned) {
    const float alpha = c.opacity();
    if (alpha >= 1.0f) return true;
    const uint32_t hash = hash_combine(hash_combine(context.key, c.instance), c.triangle);
    return alpha > 0.0f && unit_float(hash) < alpha;
  });
}

void filter_occluded(const RTCFilterFunctionNArguments* args) {
  const auto& context = *reinterpret_cast<const QueryContext*>(args->context);
  filter(args, [&](const Candidate& c, unsigned i) {
    const float alpha = c.opacity();
    if (alpha >= 1.0f) return true;
    context.passed[RTCRayN_id(args->ray, args->N, i)] *= 1.0f - std::max(alpha, 0.0f);
    return false;
  });
}

void filter_glass(const RTCFilterFunctionNArguments* args) {
  const auto& context = *reinterpret_cast<const QueryContext*>(args->context);
  filter(args, [&](const Candidate& c, unsigned i) {
    const unsigned ray = RTCRayN_id(args->ray, args->N, i);
    const float alpha = c.surface.has_alpha(c.instance) ? std::clamp(c.opacity(), 0.0f, 1.0f) : 1.0f;
    if (!(alpha > 0.0f)) return false;
    Glass& glass = context.glass[ray];
    const auto pass = c.surface.pass(c.instance, c.triangle, c.b1, c.b2, glass.direction);
    const Vec3 share = Vec3(1.0f - alpha) + pass.factor * alpha;
    if (!(max_component(share) > 0.0f)) return true;
    context.passed[ray] *= share;
    if (max_component(pass.absorption) > 0.0f) {
      const Vec3 depth = pass.absorption * (RTCRayN_tfar(args->ray, args->N, i) * glass.length);
      glass.optical += pass.enters ? -depth : depth;
      glass.inside += pass.enters ? pass.absorption : -pass.absorption;
    }
    return false;
  });
}

class EmbreeTracer final : public Tracer {
 public:
  ~EmbreeTracer() override {
    for (RTCScene scene : children_) rtcReleaseScene(scene);
    if (root_) rtcReleaseScene(root_);
    if (device_) rtcReleaseDevice(device_);
  }

  Status build(const Scene& scene, const Transparency& surface, const std::string& isa, unsigned threads,
               bool watertight);

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
    Vec3 passed;
    glass_ ? occluded<1, true>({&ray, 1}, &passed) : occluded<1, false>({&ray, 1}, &passed);
    return passed;
  }

  void transmittance(std::span<const Ray> rays, Vec3* passed) const override {
    for (size_t begin = 0; begin < rays.size(); begin += kStream) {
      const auto part = rays.subspan(begin, std::min(kStream, rays.size() - begin));
      glass_ ? occluded<kStream, true>(part, passed + begin) : occluded<kStream, false>(part, passed + begin);
    }
  }

  size_t memory_bytes() const override { return static_cast<size_t>(memory_); }

 private:
  static constexpr size_t kStream = 256;  // shadow rays passed to Embree at once
  template <size_t kMax, bool kGlass>
  void occluded(std::span<const Ray> rays, Vec3* passed) const;  // at most kMax
  static void fill(RTCRay& q, const Ray& ray) {
    q.org_x = ray.origin.x, q.org_y = ray.origin.y, q.org_z = ray.origin.z;
    q.dir_x = ray.direction.x, q.dir_y = ray.direction.y, q.dir_z = ray.direction.z;
    q.tnear = 0.0f, q.tfar = ray.far, q.time = 0.0f;
    q.mask = ~0u, q.id = 0, q.flags = 0;
  }
  // The filters of a geometry.
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
  RTCSceneFlags flags_ = RTC_SCENE_FLAG_NONE;
  ssize_t memory_ = 0;
};

template <size_t kMax, bool kGlass>
void EmbreeTracer::occluded(std::span<const Ray> rays, Vec3* passed) const {
  QueryContext context;
  embree::init(context.head);
  context.passed = passed;
  std::array<Glass, kGlass ? kMax : 0> glass;
  context.glass = glass.data();
  RTCRay q[kMax];
  for (unsigned i = 0; i < rays.size(); ++i) {
    fill(q[i], rays[i]);
    q[i].id = i;
    passed[i] = Vec3(1.0f);
    if constexpr (kGlass) {
      const float size = length(rays[i].direction);
      glass[i] = {rays[i].direction / size, size};
    }
  }
  if constexpr (kMax == 1)
    embree::occluded(root_, context.head, q[0]);
  else
    embree::occluded(root_, context.head, q, static_cast<unsigned>(rays.size()));
  for (unsigned i = 0; i < rays.size(); ++i) {
    if (q[i].tfar < 0.0f) {
      passed[i] = Vec3(0.0f);
    } else if constexpr (kGlass) {
      passed[i] *= glass[i].transmittance(rays[i].far * glass[i].length);
    }
  }
}

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
  rtcSetSceneFlags(scene, flags_);
  RTCGeometry g = triangles(mesh, nullptr, filters);
  rtcAttachGeometry(scene, g);
  rtcReleaseGeometry(g);
  rtcCommitScene(scene);
  children_.push_back(scene);
  return scene;
}

Status EmbreeTracer::build(const Scene& scene, const Transparency& surface, const std::string& isa,
                           unsigned threads, bool watertight) {
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

  if (watertight) flags_ = RTC_SCENE_FLAG_ROBUST;
  root_ = rtcNewScene(device_);
  rtcSetSceneFlags(root_, flags_);
  std::map<std::pair<uint32_t, Filters>, RTCScene> shared;  // by mesh and filters
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (!instance.cast) continue;
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
                                                 const std::string& isa, unsigned threads, bool watertight) {
  auto tracer = std::make_unique<EmbreeTracer>();
  KILN_TRY_STATUS(tracer->build(scene, transparency, isa, threads, watertight));
  return std::unique_ptr<Tracer>(std::move(tracer));
}

}  // namespace kiln
