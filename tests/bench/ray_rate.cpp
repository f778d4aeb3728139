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
#include "coordinator/import/import.h"
#include "worker/integrators/path.h"

namespace kiln {
namespace {

struct Recorded {
  Ray ray;
  uint32_t key;
  bool shadow;
};

class RecordingTracer final : public Tracer {
 public:
  RecordingTracer(const Tracer& inner, std::vector<Recorded>& out) : inner_(inner), out_(out) {}
  Hit intersect(const Ray& ray, uint32_t key) const override {
    out_.push_back({ray, key, false});
    return inner_.intersect(ray, key);
  }
  Vec3 transmittance(const Ray& ray) const override {
    out_.push_back({ray, 0, true});
    return inner_.transmittance(ray);
  }
  size_t memory_bytes() const override { return inner_.memory_bytes(); }

 private:
  const Tracer& inner_;
  std::vector<Recorded>& out_;
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
  const PathIntegrator integrator(w.surfaces, tracer, w.lights, w.settings);
  constexpr size_t kTexels = 4096, kRun = 64;
  const size_t runs = kTexels / kRun, stride = std::max<size_t>(kRun, w.atlas.sites.size() / runs);
  PathIntegrator::Task tasks[PathIntegrator::kBatch];
  double sum = 0;
  for (size_t begin = 0; begin < w.atlas.sites.size(); begin += stride)
    for (size_t site = begin; site < std::min(begin + kRun, w.atlas.sites.size()); ++site) {
      SitePicker picker(w.atlas, w.surfaces.scene(), static_cast<uint32_t>(site));
      for (uint32_t i = 0; i < w.samples; i += PathIntegrator::kBatch) {
        const size_t count = std::min<size_t>(PathIntegrator::kBatch, w.samples - i);
        for (uint32_t k = 0; k < count; ++k) {
          const SampleStream stream(0, w.atlas.sites.texel[site], i + k);
          const SitePick p = picker.pick(stream.single(0));
          tasks[k] = {w.surfaces.at(p.instance, p.triangle, p.b1, p.b2), stream, {}};
        }
        integrator.sample(std::span(tasks, count));
        for (size_t t = 0; t < count; ++t)
          for (int k = 0; k < tasks[t].splats.count; ++k) sum += tasks[t].splats.items[k].contribution.x;
      }
    }
  return sum;
}

double replay(const std::vector<Recorded>& rays, const Tracer& tracer) {
  double sum = 0;
  for (const Recorded& r : rays)
    sum += r.shadow ? tracer.transmittance(r.ray).x : tracer.intersect(r.ray, r.key).t;
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

// Both loops take turns, so that other work on the machine meets both; the ratio is the median of the turns'.
struct Rates {
  double plain_seconds, worker_seconds, ratio;
};
template <class Plain, class Worker>
Rates measure(const Plain& plain, const Worker& worker) {
  constexpr int kTurns = 15;
  std::vector<double> p, w, ratio;
  for (int turn = -1; turn < kTurns; ++turn) {  // the first turn warms up
    const double a = seconds_of(plain), b = seconds_of(worker);
    if (turn < 0) continue;
    p.push_back(a);
    w.push_back(b);
    ratio.push_back(a / b);
  }
  return {median(p), median(w), median(ratio)};
}

Status bench(const std::string& path, const BakeSettings& settings, uint32_t samples) {
  KILN_TRY(ImportResult imported, import_scene(path, settings));
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = static_cast<float>(settings.texels_per_metre);
  KILN_TRY(const Atlas atlas, build_atlas(imported.scene, a));
  std::vector<std::string> warnings;
  KILN_TRY(const auto surfaces, Surfaces::create(std::move(imported.scene), warnings));
  KILN_TRY(const auto tracer, Tracer::create(surfaces->scene(), *surfaces, settings.isa, 2));
  KILN_TRY(const Lights lights, Lights::create(*surfaces, warnings));
  const Workload workload{atlas, *surfaces, lights, {}, samples};

  std::vector<Recorded> rays;
  run_integrator(workload, RecordingTracer(*tracer, rays));
  const Rates rates =
      measure([&] { return replay(rays, *tracer); }, [&] { return run_integrator(workload, *tracer); });
  const auto shadow = std::count_if(rays.begin(), rays.end(), [](const Recorded& r) { return r.shadow; });
  const double n = static_cast<double>(rays.size());
  std::printf("| %s | %zu | %.2f M | %.0f %% | %.2f | %.2f | %.2f |\n",
              path.substr(path.rfind('/') + 1).c_str(), surfaces->scene().triangle_count(), n / 1e6,
              100.0 * static_cast<double>(shadow) / n, n / rates.worker_seconds / 1e6,
              n / rates.plain_seconds / 1e6, rates.ratio);
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
      "| scene | triangles | rays | shadow | worker M/s | plain Embree M/s | ratio "
      "|\n|---|---|---|---|---|---|---|\n");
  if (Status s = bench(scene, settings, samples); !s) {
    std::fprintf(stderr, "%s\n", s.error().message.c_str());
    return exit_status(s.error());
  }
  return 0;
}
