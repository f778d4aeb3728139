// What the integrator pays for things a scene does not have: a room of Lambert walls under one sun, baked by
// the integrator that is chosen for it, by the one that can do everything, and by a path tracer written for
// this benchmark that knows nothing but Lambert walls and one sun. All three give the same bits.
//   build/bin/specialisation [--turns N]
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>

#include "common/atlas/site_picker.h"
#include "common/base/clock.h"
#include "common/math/sequence_batch.h"
#include "common/math/warp.h"
#include "tests/analytic/scene_maker.h"
#include "worker/integrators/integrator.h"

namespace kiln {
namespace {

using Task = Integrator::Task;
constexpr size_t kBatch = Integrator::kBatch;

// A hall of 12 x 4 x 12 m, open to the sun on one side, with 400 boxes.
Scene hall() {
  test::SceneMaker m;
  m.lambert(Vec3(0.7f, 0.6f, 0.5f));
  m.quad({0, 0, 0}, {0, 0, 12}, {12, 0, 0});
  m.quad({0, 4, 0}, {12, 0, 0}, {0, 0, 12});
  m.quad({0, 0, 0}, {0, 4, 0}, {0, 0, 12});
  m.quad({0, 0, 12}, {0, 4, 0}, {12, 0, 0});
  m.quad({0, 0, 0}, {12, 0, 0}, {0, 4, 0});
  for (uint32_t i = 0; i < 400; ++i) {
    const auto random = [&](uint32_t k) { return unit_float(hash_combine(i, k)); };
    const Vec3 low(random(0) * 11.0f, random(1) * 3.0f, random(2) * 11.0f);
    m.box(low, low + Vec3(0.1f + 0.5f * random(3), 0.1f + 0.5f * random(4), 0.1f + 0.5f * random(5)), false);
  }
  m.sun(Vec3(1.0f, 0.6f, 0.3f), Vec3(8.0f, 7.5f, 6.5f), 0.53f);
  return m.take();
}

struct Workload {
  Atlas atlas;
  std::unique_ptr<Surfaces> surfaces;
  std::unique_ptr<Tracer> tracer;
  Lights lights;
  TransportSettings settings;
};

// Nothing but Lambert walls and one sun.
class BareIntegrator final : public Integrator {
 public:
  BareIntegrator(const Workload& w, const Vec3& albedo) : w_(w), albedo_(albedo) {}
  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<Wave>(); }
  void sample(std::span<Task> tasks, Workspace& workspace, const KnownIrradiance*) const override;

 private:
  struct Path {
    Vec3 position, ng, ns, direction, throughput, sum, first_direction;
    float error, first_pdf;
  };
  struct Wave final : Workspace {
    Path paths[kBatch];
    uint32_t live[kBatch], shadow_path[kBatch];
    Ray rays[kBatch];
    Vec3 light[kBatch], passed[kBatch];
    Hit hits[kBatch];
    float u[2][kBatch], v[2][kBatch];
    SampleBatch samples;
    size_t count = 0;
  };
  void gather(Wave& w, std::span<Task> tasks, uint32_t first_dimension, bool texel) const;
  void finish(const Path& p, Task& task) const {
    if (!(max_component(p.sum) <= 0.0f))
      task.radiance.add(p.first_direction, p.sum / p.first_pdf, Arriving::kAlongPath);
  }
  const Workload& w_;
  Vec3 albedo_;
};

void BareIntegrator::gather(Wave& w, std::span<Task> tasks, uint32_t first_dimension, bool texel) const {
  w.samples.pairs(first_dimension + 5, w.live, w.count, w.u[0], w.u[1]);
  size_t shadows = 0;
  for (size_t k = 0; k < w.count; ++k) {
    const Path& p = w.paths[w.live[k]];
    if (!w_.lights.directional.may_light(p.ns)) continue;
    const LightSample s = w_.lights.directional.sample(0.0f, {w.u[0][k], w.u[1][k]});
    const float cos = dot(s.direction, p.ns);
    if (cos <= 0.0f || dot(s.direction, p.ng) <= 0.0f) continue;
    w.light[shadows] = texel ? s.weight : s.weight * (albedo_ * kInvPi * cos);
    w.rays[shadows] = {offset_origin(p.position, p.ng, p.error), s.direction};
    w.shadow_path[shadows++] = w.live[k];
  }
  w_.tracer->transmittance(std::span(w.rays, shadows), w.passed);
  for (size_t k = 0; k < shadows; ++k) {
    Task& task = tasks[w.shadow_path[k]];
    ++task.radiance.rays;
    if (!(max_component(w.passed[k]) > 0.0f)) continue;
    Path& p = w.paths[w.shadow_path[k]];
    if (texel)
      task.radiance.add(w.rays[k].direction, w.light[k] * w.passed[k], Arriving::kDirect);
    else
      p.sum += p.throughput * (w.light[k] * w.passed[k]);
  }
}

void BareIntegrator::sample(std::span<Task> tasks, Workspace& workspace, const KnownIrradiance*) const {
  auto& w = static_cast<Wave&>(workspace);
  w.samples.clear();
  w.count = tasks.size();
  for (uint32_t i = 0; i < tasks.size(); ++i) {
    const SurfacePoint& at = tasks[i].receiver;
    Path& p = w.paths[i];
    p.position = at.position, p.ng = at.ng, p.ns = at.ns, p.error = at.error;
    p.throughput = Vec3(1.0f), p.sum = Vec3(0.0f);
    w.samples.add(tasks[i].stream);
    w.live[i] = i;
  }
  gather(w, tasks, 1, true);
  w.samples.pairs(1, w.live, w.count, w.u[0], w.u[1]);
  size_t kept = 0;
  for (size_t k = 0; k < w.count; ++k) {
    Path& p = w.paths[w.live[k]];
    const Vec3 local = mixed_hemisphere({w.u[0][k], w.u[1][k]});
    p.direction = p.first_direction = Frame(p.ns).to_world(local);
    p.first_pdf = mixed_hemisphere_pdf(local.z);
    if (dot(p.direction, p.ng) > 0.0f) w.live[kept++] = w.live[k];
  }
  w.count = kept;
  for (uint32_t bounces = 0; w.count; ++bounces) {
    const uint32_t here = 1 + bounces * 7, next = here + 7;
    for (size_t k = 0; k < w.count; ++k) {
      Path& p = w.paths[w.live[k]];
      Task& task = tasks[w.live[k]];
      ++task.radiance.rays;
      w.hits[w.live[k]] = w_.tracer->intersect({offset_origin(p.position, p.ng, p.error), p.direction},
                                               task.stream.bits(here));
      const Hit& hit = w.hits[w.live[k]];
      if (hit.valid()) w_.surfaces->prefetch(hit.instance, hit.triangle);
    }
    kept = 0;
    for (size_t k = 0; k < w.count; ++k) {
      const uint32_t i = w.live[k];
      Path& p = w.paths[i];
      const Hit& hit = w.hits[i];
      bool goes_on = hit.valid();
      if (goes_on) {
        const SurfacePoint at = w_.surfaces->at(hit.instance, hit.triangle, hit.b1, hit.b2);
        if (dot(p.direction, at.ng) > 0.0f) {
          if (bounces == 0) tasks[i].radiance.inside = true;
          goes_on = false;
        } else {
          p.position = at.position, p.ng = at.ng, p.error = at.error;
          p.ns = dot(p.direction, at.ns) >= 0.0f ? at.ng : at.ns;
          goes_on = bounces < w_.settings.max_bounces;
        }
      }
      if (goes_on)
        w.live[kept++] = i;
      else
        finish(p, tasks[i]);
    }
    w.count = kept;
    if (!w.count) break;
    gather(w, tasks, next, false);
    const bool roulette = bounces + 1 >= 3;
    if (roulette) w.samples.pairs(next + 1, w.live, w.count, w.v[0], w.v[1]);
    w.samples.pairs(next, w.live, w.count, w.u[0], w.u[1]);
    kept = 0;
    for (size_t k = 0; k < w.count; ++k) {
      const uint32_t i = w.live[k];
      Path& p = w.paths[i];
      const Vec3 local = cosine_hemisphere({w.u[0][k], w.u[1][k]});
      p.direction = Frame(p.ns).to_world(local);
      p.throughput *= local.z > 0.0f ? albedo_ : Vec3(0.0f);
      bool goes_on = max_component(p.throughput) > 0.0f && dot(p.direction, p.ng) > 0.0f;
      if (roulette && goes_on) {
        const float survival = std::min(1.0f, max_component(p.throughput));
        goes_on = w.v[1][k] < survival;
        p.throughput /= survival;
      }
      if (goes_on)
        w.live[kept++] = i;
      else
        finish(p, tasks[i]);
    }
    w.count = kept;
  }
}

// Runs 512 texels of 64 samples; `sum` adds up everything they gave, in order.
double run(const Workload& w, const Integrator& integrator, double& sum) {
  const auto workspace = integrator.make_workspace();
  Task tasks[kBatch];
  sum = 0;
  const Stopwatch watch;
  const size_t stride = std::max<size_t>(1, w.atlas.sites.size() / 512);
  for (uint32_t site = 0; site < w.atlas.sites.size(); site += static_cast<uint32_t>(stride)) {
    SitePicker picker(w.atlas, site);
    for (uint32_t first = 0; first < 64; first += kBatch) {
      for (uint32_t k = 0; k < kBatch; ++k) {
        const SampleStream stream(0, w.atlas.sites.texel[site], first + k);
        const SitePick p = picker.pick(stream.single(0));
        tasks[k] = {w.surfaces->at(p.instance, p.triangle, p.b1, p.b2), stream, {}};
      }
      integrator.sample(tasks, *workspace);
      for (const Task& task : tasks)
        for (int i = 0; i < task.radiance.count; ++i)
          sum += task.radiance.items[i].contribution.x * task.radiance.items[i].direction.y;
    }
  }
  return watch.seconds();
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

int bench(int turns) {
  Workload w;
  Scene scene = hall();
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = 6;
  auto atlas = build_atlas(scene, a);
  std::vector<std::string> warnings;
  auto surfaces = Surfaces::create(std::move(scene), warnings);
  if (!atlas || !surfaces) return 1;
  w.atlas = std::move(*atlas);
  w.surfaces = std::move(*surfaces);
  auto tracer = Tracer::create(w.surfaces->scene(), *w.surfaces, "avx2", 2);
  auto lights = Lights::create(*w.surfaces, warnings);
  if (!tracer || !lights) return 1;
  w.tracer = std::move(*tracer);
  w.lights = std::move(*lights);

  const uint32_t features = find_features(*w.surfaces, w.lights);
  const auto chosen = Integrator::create(*w.surfaces, *w.tracer, w.lights, w.settings, features);
  const auto everything = Integrator::create(*w.surfaces, *w.tracer, w.lights, w.settings, kAllFeatures);
  const BareIntegrator bare(w, Vec3(0.7f, 0.6f, 0.5f));
  std::vector<double> chosen_ratio, everything_ratio;
  double sums[3];
  for (int turn = -1; turn < turns; ++turn) {  // the first warms up
    const double b = run(w, bare, sums[0]), c = run(w, *chosen, sums[1]), e = run(w, *everything, sums[2]);
    if (sums[0] != sums[1] || sums[0] != sums[2]) {
      std::fprintf(stderr, "the integrators disagree: %.17g %.17g %.17g\n", sums[0], sums[1], sums[2]);
      return 1;
    }
    if (turn < 0) continue;
    chosen_ratio.push_back(c / b);
    everything_ratio.push_back(e / b);
  }
  std::printf("| integrator | time, of the bare one's |\n|---|---|\n");
  std::printf("| chosen for the scene (features %u) | %.3f |\n", features, median(chosen_ratio));
  std::printf("| of everything | %.3f |\n", median(everything_ratio));
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  int turns = 41;
  if (argc == 3 && std::strcmp(argv[1], "--turns") == 0) turns = std::max(1, std::atoi(argv[2]));
  return kiln::bench(turns);
}
