// Rays per second of the worker's integrator against a plain loop of Embree calls over the very same rays,
// recorded from it in the same order, on one thread. Prints one table row a scene, medians of repeats.
//   build/bin/ray_rate SCENE [--samples N] [--texels-per-metre D] [--environment R,G,B] [--sun ...]
#include <algorithm>
#include <cstdio>
#include <cstring>

#include "common/atlas/atlas.h"
#include "common/atlas/site_picker.h"
#include "common/base/clock.h"
#include "common/base/format.h"
#include "coordinator/scene/import/import.h"
#include "worker/integrators/integrator.h"

namespace kiln {
namespace {

// A path's ray, or shadow rays that were handed over together.
struct Recorded {
  Ray ray;
  uint32_t key;
  uint32_t shadows = 0, first_shadow = 0;  // in Recording::shadows
};
struct Recording {
  std::vector<Recorded> calls;
  std::vector<Ray> shadows;
  size_t rays() const {
    size_t n = shadows.size();
    for (const Recorded& r : calls) n += r.shadows == 0;
    return n;
  }
};

class RecordingTracer final : public Tracer {
 public:
  RecordingTracer(const Tracer& inner, Recording& out) : inner_(inner), out_(out) {}
  Hit intersect(const Ray& ray, uint32_t key) const override {
    out_.calls.push_back({ray, key});
    return inner_.intersect(ray, key);
  }
  Vec3 transmittance(const Ray& ray) const override {
    Vec3 passed;
    transmittance({&ray, 1}, &passed);
    return passed;
  }
  void transmittance(std::span<const Ray> rays, Vec3* passed) const override {
    if (rays.empty()) return;
    out_.calls.push_back(
        {{}, 0, static_cast<uint32_t>(rays.size()), static_cast<uint32_t>(out_.shadows.size())});
    out_.shadows.insert(out_.shadows.end(), rays.begin(), rays.end());
    inner_.transmittance(rays, passed);
  }
  size_t memory_bytes() const override { return inner_.memory_bytes(); }

 private:
  const Tracer& inner_;
  Recording& out_;
};

struct Workload {
  const Atlas& atlas;
  const Surfaces& surfaces;
  const Lights& lights;
  TransportSettings settings;
  uint32_t samples;
};

// Every k-th texel in site order, so that the whole scene takes part and the order stays the bake's.
double run_integrator(const Workload& w, const Tracer& tracer) {
  const auto integrator =
      Integrator::create(w.surfaces, tracer, w.lights, w.settings, find_features(w.surfaces, w.lights));
  const auto workspace = integrator->make_workspace();
  constexpr size_t kTexels = 4096, kRun = 64;
  const size_t runs = kTexels / kRun, stride = std::max<size_t>(kRun, w.atlas.sites.size() / runs);
  Integrator::Task tasks[Integrator::kBatch];
  double sum = 0;
  for (size_t begin = 0; begin < w.atlas.sites.size(); begin += stride)
    for (size_t site = begin; site < std::min(begin + kRun, w.atlas.sites.size()); ++site) {
      SitePicker picker(w.atlas, static_cast<uint32_t>(site));
      for (uint32_t i = 0; i < w.samples; i += Integrator::kBatch) {
        const size_t count = std::min<size_t>(Integrator::kBatch, w.samples - i);
        for (uint32_t k = 0; k < count; ++k) {
          const SampleStream stream(0, w.atlas.sites.texel[site], i + k);
          const SitePick p = picker.pick(stream.single(0));
          tasks[k] = {w.surfaces.at(p.instance, p.triangle, p.b1, p.b2), stream, {}};
        }
        integrator->sample(std::span(tasks, count), *workspace);
        for (size_t t = 0; t < count; ++t)
          for (int k = 0; k < tasks[t].radiance.count; ++k) sum += tasks[t].radiance.items[k].contribution.x;
      }
    }
  return sum;
}

// The recorded rays in their order, one by one, or shadow rays together as the integrator hands them over.
double replay(const Recording& recording, const Tracer& tracer, bool batched) {
  double sum = 0;
  Vec3 passed[1024];
  for (const Recorded& r : recording.calls) {
    const std::span shadows(recording.shadows.data() + r.first_shadow, r.shadows);
    if (shadows.empty()) {
      sum += tracer.intersect(r.ray, r.key).t;
    } else if (batched) {
      tracer.transmittance(shadows, passed);
      for (size_t i = 0; i < shadows.size(); ++i) sum += passed[i].x;
    } else {
      for (const Ray& ray : shadows) sum += tracer.transmittance(ray).x;
    }
  }
  return sum;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

template <class F>
double seconds_of(const F& f) {
  const Stopwatch watch;
  volatile double keep = f();
  (void)keep;
  return watch.seconds();
}

// The loops take turns, so that other work on the machine meets all; ratios are medians of the turns'.
struct Rates {
  double plain_seconds, worker_seconds, ratio, batched_ratio;
};
template <class Plain, class Batched, class Worker>
Rates measure(const Plain& plain, const Batched& batched, const Worker& worker) {
  constexpr int kTurns = 15;
  std::vector<double> p, w, ratio, batched_ratio;
  for (int turn = -1; turn < kTurns; ++turn) {  // the first turn warms up
    const double a = seconds_of(plain), b = seconds_of(worker), c = seconds_of(batched);
    if (turn < 0) continue;
    p.push_back(a);
    w.push_back(b);
    ratio.push_back(a / b);
    batched_ratio.push_back(a / c);
  }
  return {median(p), median(w), median(ratio), median(batched_ratio)};
}

Status bench(const std::string& path, const BakeSettings& settings, uint32_t samples) {
  KILN_TRY(ImportResult imported, import_scene(path, settings));
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = static_cast<float>(settings.texels_per_metre);
  KILN_TRY(const Atlas atlas, build_atlas(imported.scene, a));
  std::vector<std::string> warnings;
  KILN_TRY(const auto surfaces, Surfaces::create(std::move(imported.scene), warnings));
  KILN_TRY(const auto tracer,
           Tracer::create(surfaces->scene(), *surfaces, settings.isa, 2, settings.watertight));
  KILN_TRY(const Lights lights, Lights::create(*surfaces, warnings));
  const Workload workload{atlas, *surfaces, lights, {}, samples};

  Recording rays;
  run_integrator(workload, RecordingTracer(*tracer, rays));
  const Rates rates =
      measure([&] { return replay(rays, *tracer, false); }, [&] { return replay(rays, *tracer, true); },
              [&] { return run_integrator(workload, *tracer); });
  if (replay(rays, *tracer, false) != replay(rays, *tracer, true))
    return fail(ErrorKind::kInternal, "shadow rays traced together meet other things than one by one");
  const double n = static_cast<double>(rays.rays());
  std::printf("| %s | %zu | %.2f M | %.0f %% | %.2f | %.2f | %.2f | %.2f |\n",
              path.substr(path.rfind('/') + 1).c_str(), surfaces->scene().triangle_count(), n / 1e6,
              100.0 * static_cast<double>(rays.shadows.size()) / n, n / rates.worker_seconds / 1e6,
              n / rates.plain_seconds / 1e6, rates.ratio, rates.batched_ratio);
  return {};
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  using namespace kiln;
  BakeSettings settings;
  uint32_t samples = 16;
  std::string scene;
  for (int i = 1; i < argc; ++i) {
    if (std::strncmp(argv[i], "--", 2) != 0) {
      scene = argv[i];
      continue;
    }
    const std::string name = argv[i] + 2, value = i + 1 < argc ? argv[++i] : "";
    if (name == "samples") {
      samples = static_cast<uint32_t>(std::stoul(value));
    } else if (Status s = set_option(settings, name, value, "command line"); !s) {
      std::fprintf(stderr, "%s\n", s.error().message.c_str());
      return 2;
    }
  }
  std::printf(
      "| scene | triangles | rays | shadow | worker M/s | plain Embree M/s | ratio | plain, shadow rays "
      "together |\n|---|---|---|---|---|---|---|---|\n");
  if (Status s = bench(scene, settings, samples); !s) {
    std::fprintf(stderr, "%s\n", s.error().message.c_str());
    return exit_status(s.error());
  }
  return 0;
}
