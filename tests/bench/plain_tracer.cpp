// The floor: a path tracer as one writes it in an afternoon, on the same scene, atlas and texel sites as
// Kiln. Single Embree rays, pcg32 random numbers, the same number of samples everywhere, one light chosen by
// power and one ray to it at every vertex, Lambert, roulette from the fourth vertex on.
//   build/bin/plain_tracer SCENE OUT SAMPLES [--SETTING VALUE]...
// Reads SCENE.kiln.json as `kiln bake` does and writes irradiance.exr, error.exr and validity.exr, which
// `kiln compare` measures; prints JSON with seconds and rays of the tracing alone. Textures, gloss, glass,
// image environments and IES lamps are refused: it is for scenes without.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/atlas/site_picker.h"
#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/parallel.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/exr.h"
#include "worker/accel/embree_api.h"

namespace kiln {
namespace {

constexpr float kPi = 3.14159265f, kFar = 1e30f;
constexpr uint32_t kSafeVertices = 4;  // before roulette

// O'Neill 2014, PCG: pcg32_random_r.
class Pcg32 {
 public:
  Pcg32(uint64_t seed, uint64_t stream) : increment_(stream << 1 | 1) {
    next();
    state_ += seed;
    next();
  }
  float uniform() { return static_cast<float>(next() >> 8) * 0x1p-24f; }

 private:
  uint32_t next() {
    const uint64_t old = state_;
    state_ = old * 6364136223846793005ull + increment_;
    const auto x = static_cast<uint32_t>((old >> 18 ^ old) >> 27), turn = static_cast<uint32_t>(old >> 59);
    return x >> turn | x << (-turn & 31);
  }
  uint64_t state_ = 0, increment_;
};

struct Surface {
  Vec3 albedo, emission;
  bool double_sided;
};

struct Triangle {
  Vec3 a, b, c, normal;
  uint32_t material;
};

struct Lamp {  // a shining triangle, a point or a spot
  uint32_t triangle = ~0u;
  Vec3 place{0.0f}, intensity{0.0f}, axis{0.0f};
  float cone_scale = 0, cone_offset = 1;
  float area = 0;
};

struct Sun {
  Vec3 to_light, irradiance, u, v;
  float one_minus_cos;  // of the half angle of the disc
};

Vec3 vec_of(const Record& r, const char* name, const Vec3& fallback) {
  const Property* p = r.find(name);
  return p && p->numbers.size() >= 3 ? Vec3(p->numbers[0], p->numbers[1], p->numbers[2]) : fallback;
}

float number_of(const Record& r, const char* name, float fallback) {
  const Property* p = r.find(name);
  return p && !p->numbers.empty() ? static_cast<float>(p->numbers[0]) : fallback;
}

void frame_of(const Vec3& n, Vec3& u, Vec3& v) {
  u = glm::normalize(std::fabs(n.x) > 0.5f ? glm::cross(n, Vec3(0, 1, 0)) : glm::cross(n, Vec3(1, 0, 0)));
  v = glm::cross(n, u);
}

float power_of(const Vec3& c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

class PlainTracer {
 public:
  static Expected<std::unique_ptr<PlainTracer>> create(const Scene& scene, const Atlas& atlas,
                                                       uint32_t max_bounces) {
    auto t = std::unique_ptr<PlainTracer>(new PlainTracer(atlas, max_bounces));
    for (const Record& m : scene.materials) KILN_TRY_STATUS(t->add_material(m));
    for (const Instance& i : scene.instances) t->add_instance(i, scene.meshes[i.mesh]);
    for (const Record& l : scene.lights) KILN_TRY_STATUS(t->add_light(l));
    t->build();
    return t;
  }
  ~PlainTracer() {
    rtcReleaseScene(embree_);
    rtcReleaseDevice(device_);
  }

  struct Estimate {
    Vec3 mean{0.0f};
    float error = 0;
    bool inside = false;
  };
  // E of a site from `samples` paths; those from points inside of geometry, whose first ray meets a back
  // face, do not count.
  Estimate estimate(uint32_t site, uint32_t samples, uint64_t seed, uint64_t& rays) const {
    SitePicker picker(atlas_, site);
    Pcg32 random(seed, site);
    DVec3 sum(0.0);
    double squares = 0;
    uint32_t backs = 0;
    for (uint32_t i = 0; i < samples; ++i) {
      const SitePick pick = picker.pick(random.uniform());
      const Triangle& t = triangles_[first_[pick.instance] + pick.triangle];
      bool back = false;
      const Vec3 e = path(t.a + pick.b1 * (t.b - t.a) + pick.b2 * (t.c - t.a), t.normal, random, rays, back);
      backs += back;
      if (back) continue;
      sum += DVec3(e);
      squares += double{power_of(e)} * power_of(e);
    }
    const double n = std::max(1u, samples - backs);
    Estimate out;
    out.mean = Vec3(sum / n);
    const double mean = power_of(out.mean);
    out.error = static_cast<float>(std::sqrt(std::max(0.0, squares / n - mean * mean) / n));
    out.inside = 2 * backs > samples;
    return out;
  }

 private:
  PlainTracer(const Atlas& atlas, uint32_t max_bounces) : atlas_(atlas), max_bounces_(max_bounces) {}

  Status add_material(const Record& m) {
    const auto textured = [&](const char* name) {
      const Property* p = m.find(name);
      return p && p->texture.texture >= 0;
    };
    const Property* mode = m.find("alpha_mode");
    if (m.type != "metallic_roughness" || textured("base_color_texture") || textured("emission_texture") ||
        number_of(m, "metallic", 1) > 0 || number_of(m, "specular", 1) > 0 ||
        number_of(m, "transmission", 0) > 0 || number_of(m, "clearcoat", 0) > 0 ||
        (mode && mode->word != "opaque"))
      return fail(ErrorKind::kInvalidInput,
                  text("material '{}' is more than a Lambert surface of one colour", m.name));
    materials_.push_back({vec_of(m, "base_color", Vec3(1.0f)), vec_of(m, "emission", Vec3(0.0f)),
                          number_of(m, "double_sided", 0) != 0});
    return {};
  }

  void add_instance(const Instance& instance, const Mesh& mesh) {
    first_.push_back(static_cast<uint32_t>(triangles_.size()));
    const float side = glm::determinant(Mat3(instance.to_world)) < 0 ? -1.0f : 1.0f;
    for (const UVec3& index : mesh.triangles) {
      const auto at = [&](uint32_t i) { return instance.to_world * Vec4(mesh.positions[i], 1.0f); };
      Triangle t{at(index.x), at(index.y), at(index.z), Vec3(0.0f), instance.material};
      const Vec3 cross = glm::cross(t.b - t.a, t.c - t.a);
      t.normal = side * glm::normalize(cross);
      const Vec3 emission = materials_[t.material].emission;
      if (power_of(emission) > 0) {
        Lamp lamp;
        lamp.triangle = static_cast<uint32_t>(triangles_.size());
        lamp.area = 0.5f * glm::length(cross);
        lamp.intensity = emission;
        add_lamp(lamp, kPi * lamp.area * power_of(emission));
      }
      triangles_.push_back(t);
    }
  }

  Status add_light(const Record& l) {
    const Vec3 light = vec_of(l, "color", Vec3(1.0f)) * number_of(l, "intensity", 1);
    if (l.type == "environment" && (!l.find("image") || l.find("image")->texture.texture < 0)) {
      sky_ += vec_of(l, "radiance", Vec3(0.0f));
      return {};
    }
    if (l.type == "directional") {
      const float half = 0.5f * number_of(l, "angle", 0) * kPi / 180;
      Sun sun{glm::normalize(l.to_world[2]), light, {}, {}, 2 * std::sin(half / 2) * std::sin(half / 2)};
      frame_of(sun.to_light, sun.u, sun.v);
      suns_.push_back(sun);
      return {};
    }
    if (l.type != "point" && l.type != "spot")
      return fail(ErrorKind::kInvalidInput, text("light '{}' is of type {}", l.name, l.type));
    Lamp lamp;
    lamp.place = l.to_world[3];
    lamp.intensity = light;
    if (l.type == "spot") {
      const float inner = std::cos(number_of(l, "inner", 0)),
                  outer = std::cos(number_of(l, "outer", 0.785398f));
      lamp.axis = -glm::normalize(l.to_world[2]);
      lamp.cone_scale = 1 / std::max(0.001f, inner - outer);
      lamp.cone_offset = -outer * lamp.cone_scale;
    }
    add_lamp(lamp, 4 * kPi * power_of(light));
    return {};
  }

  void add_lamp(const Lamp& lamp, float power) {
    lamps_.push_back(lamp);
    cumulative_.push_back((cumulative_.empty() ? 0 : cumulative_.back()) + power);
  }

  void build() {
    device_ = rtcNewDevice("threads=1");
    embree_ = rtcNewScene(device_);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * triangles_.size()));
    auto* index = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles_.size()));
    for (uint32_t i = 0; i < triangles_.size(); ++i)
      for (uint32_t k = 0; k < 3; ++k) {
        const Vec3& p = k == 0 ? triangles_[i].a : k == 1 ? triangles_[i].b : triangles_[i].c;
        for (int axis = 0; axis < 3; ++axis) corners[(3 * i + k) * 3 + static_cast<uint32_t>(axis)] = p[axis];
        index[3 * i + k] = 3 * i + k;
        extent_ = std::max({extent_, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
      }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneBuildQuality(embree_, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(embree_);
  }

  static void fill(RTCRay& ray, const Vec3& from, const Vec3& direction, float far) {
    ray.org_x = from.x, ray.org_y = from.y, ray.org_z = from.z;
    ray.dir_x = direction.x, ray.dir_y = direction.y, ray.dir_z = direction.z;
    ray.tnear = 0, ray.tfar = far, ray.time = 0, ray.mask = ~0u, ray.id = 0, ray.flags = 0;
  }

  bool blocked(const Vec3& from, const Vec3& direction, float far, uint64_t& rays) const {
    ++rays;
    embree::Context context;
    embree::init(context);
    RTCRay ray;
    fill(ray, from, direction, far);
    embree::occluded(embree_, context, ray);
    return ray.tfar < 0;
  }

  // Irradiance that arrives straight from suns and one lamp.
  Vec3 direct(const Vec3& from, const Vec3& normal, Pcg32& random, uint64_t& rays) const {
    Vec3 sum(0.0f);
    for (const Sun& sun : suns_) {
      const float drop = random.uniform() * sun.one_minus_cos, turn = 2 * kPi * random.uniform();
      const float c = 1 - drop, s = std::sqrt(std::max(0.0f, 1 - c * c));
      const Vec3 d = s * std::cos(turn) * sun.u + s * std::sin(turn) * sun.v + c * sun.to_light;
      const float cosine = glm::dot(d, normal);
      // Uniform over the disc: its irradiance on a facing surface is the sun's.
      const float scale = sun.one_minus_cos > 0 ? 2 / (2 - sun.one_minus_cos) : 1;
      if (cosine > 0 && !blocked(from, d, kFar, rays)) sum += sun.irradiance * (cosine * scale);
    }
    if (lamps_.empty()) return sum;
    const float mark = random.uniform() * cumulative_.back();
    const size_t i =
        std::min<size_t>(static_cast<size_t>(std::upper_bound(cumulative_.begin(), cumulative_.end(), mark) -
                                             cumulative_.begin()),
                         lamps_.size() - 1);
    const Lamp& lamp = lamps_[i];
    const float chance = (cumulative_[i] - (i ? cumulative_[i - 1] : 0)) / cumulative_.back();
    const float u = random.uniform(), v = random.uniform();
    Vec3 to = lamp.place;
    if (lamp.triangle != ~0u) {
      const Triangle& t = triangles_[lamp.triangle];
      const float root = std::sqrt(u);
      to = t.a + root * (1 - v) * (t.b - t.a) + root * v * (t.c - t.a);
    }
    Vec3 d = to - from;
    const float square = glm::dot(d, d), distance = std::sqrt(square);
    d /= distance;
    float weight = glm::dot(d, normal) / (square * chance);
    if (lamp.triangle != ~0u) {
      weight *= lamp.area * -glm::dot(d, triangles_[lamp.triangle].normal);
    } else if (lamp.cone_scale > 0) {
      const float fade = std::clamp(-glm::dot(d, lamp.axis) * lamp.cone_scale + lamp.cone_offset, 0.0f, 1.0f);
      weight *= fade * fade;
    }
    if (!(weight > 0) || blocked(from, d, distance * 0.9999f, rays)) return sum;
    return sum + lamp.intensity * weight;
  }

  Vec3 path(Vec3 place, Vec3 normal, Pcg32& random, uint64_t& rays, bool& met_back) const {
    Vec3 sum(0.0f), weight(1.0f);
    for (uint32_t vertex = 0;; ++vertex) {
      const Vec3 from = place + normal * (1e-4f * extent_);
      sum += weight * direct(from, normal, random, rays);
      if (vertex == max_bounces_) return sum;
      Vec3 u, v;
      frame_of(normal, u, v);
      const float radius = random.uniform(), turn = 2 * kPi * random.uniform(), r = std::sqrt(radius);
      const Vec3 d = r * std::cos(turn) * u + r * std::sin(turn) * v + std::sqrt(1 - radius) * normal;
      ++rays;
      embree::Context context;
      embree::init(context);
      RTCRayHit hit;
      fill(hit.ray, from, d, kFar);
      hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      embree::intersect(embree_, context, hit);
      if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return sum + weight * kPi * sky_;
      const Triangle& t = triangles_[hit.hit.primID];
      const Surface& surface = materials_[t.material];
      const bool back = glm::dot(t.normal, d) > 0;
      if (back && !surface.double_sided) {
        met_back = vertex == 0;
        return sum;
      }
      normal = back ? -t.normal : t.normal;
      place = from + hit.ray.tfar * d;
      weight *= surface.albedo;
      const float most = std::max({weight.x, weight.y, weight.z});
      if (most <= 0) return sum;
      if (vertex + 1 < kSafeVertices) continue;
      const float live = std::min(1.0f, std::max({surface.albedo.x, surface.albedo.y, surface.albedo.z}));
      if (random.uniform() >= live) return sum;
      weight /= live;
    }
  }

  const Atlas& atlas_;
  const uint32_t max_bounces_;
  std::vector<Surface> materials_;
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> first_;  // triangle of each instance
  std::vector<Lamp> lamps_;
  std::vector<float> cumulative_;  // power of the lamps
  std::vector<Sun> suns_;
  Vec3 sky_{0.0f};
  float extent_ = 0;
  RTCDevice device_ = nullptr;
  RTCScene embree_ = nullptr;
};

Expected<BakeSettings> settings_of(const std::string& scene, int argc, char** argv) {
  BakeSettings settings;
  settings.layout = "pack";
  const auto beside = std::filesystem::path(scene).replace_extension(".kiln.json");
  if (std::filesystem::exists(beside)) {
    KILN_TRY(const Bytes bytes, read_file(beside, 1 << 20));
    KILN_TRY(const auto pairs, parse_flat_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
    for (const auto& row : pairs) KILN_TRY_STATUS(set_option(settings, row.first, row.second, "job file"));
  }
  for (int i = 4; i + 1 < argc; i += 2) {
    if (std::string_view(argv[i]).substr(0, 2) != "--")
      return fail(ErrorKind::kUsage, text("'{}' is no setting", argv[i]));
    KILN_TRY_STATUS(set_option(settings, argv[i] + 2, argv[i + 1], "command line"));
  }
  return settings;
}

Status trace(const std::string& name, const std::filesystem::path& out, uint32_t samples,
             const BakeSettings& settings) {
  std::vector<StageTime> times;
  KILN_TRY(const Preflight pre, run_preflight(name, settings, times, [](const BakeProgress&) {}));
  const Atlas& atlas = pre.atlas;
  if (atlas.pages != 1)
    return fail(ErrorKind::kUsage, "the map has more than one page: lower --texels-per-metre");
  KILN_TRY(const auto tracer, PlainTracer::create(pre.imported.scene, atlas, settings.max_bounces));
  const size_t texels = atlas.texel_count();
  std::vector<float> planes[3], alpha(texels, 0), error(texels, 0), validity(texels, 0);
  for (auto& plane : planes) plane.assign(texels, 0);
  std::vector<uint64_t> rays(atlas.sites.size(), 0);
  const unsigned threads = settings.threads ? settings.threads : hardware_threads();
  const Stopwatch watch;
  parallel_for(
      atlas.sites.size(),
      [&](size_t site) {
        const auto e = tracer->estimate(static_cast<uint32_t>(site), samples, settings.seed, rays[site]);
        const uint32_t texel = atlas.sites.texel[site];
        for (int c = 0; c < 3; ++c) planes[c][texel] = e.mean[c];
        alpha[texel] = 1;
        error[texel] = e.error;
        validity[texel] = static_cast<float>(e.inside ? Validity::kInside : Validity::kMeasured);
      },
      threads);
  const double seconds = watch.seconds();
  uint64_t all = 0;
  for (const uint64_t n : rays) all += n;
  KILN_TRY_STATUS(prepare_output_folder(out, 0));
  const ExrChannel light[] = {
      {"R", planes[0].data()}, {"G", planes[1].data()}, {"B", planes[2].data()}, {"A", alpha.data()}};
  const ExrChannel errors[] = {{"Y", error.data()}}, classes[] = {{"Y", validity.data()}};
  KILN_TRY_STATUS(write_exr(out / "irradiance.exr", atlas.width, atlas.height, light));
  KILN_TRY_STATUS(write_exr(out / "error.exr", atlas.width, atlas.height, errors));
  KILN_TRY_STATUS(write_exr(out / "validity.exr", atlas.width, atlas.height, classes));
  JsonWriter w;
  w.begin_object()
      .pair("seconds", seconds)
      .pair("threads", threads)
      .pair("rays", all)
      .pair("samples", samples);
  w.pair("texels", uint64_t{atlas.sites.size()}).end_object();
  std::fputs(w.take().c_str(), stdout);
  return {};
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  using namespace kiln;
  const long samples = argc > 3 ? std::atol(argv[3]) : 0;
  if (samples < 1 || samples > 1 << 24) {
    std::fprintf(stderr, "usage: plain_tracer SCENE OUT SAMPLES [--SETTING VALUE]...\n");
    return 2;
  }
  const auto settings = settings_of(argv[1], argc, argv);
  const Status s = settings ? trace(argv[1], argv[2], static_cast<uint32_t>(samples), *settings)
                            : tl::unexpected<Error>(settings.error());
  if (s) return 0;
  std::fprintf(stderr, "%s\n", s.error().message.c_str());
  return exit_status(s.error());
}
