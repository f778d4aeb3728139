#include "tests/equivalence/ready_scene.h"

#include "worker/bake/film.h"
#include "worker/surface/coincident.h"

namespace kiln::test {
namespace {

template <class T>
T must(Expected<T> made) {
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

}  // namespace

ReadyScene::ReadyScene(Scene scene, LightChoice choice) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = 2;
  atlas_ = must(build_atlas(scene, a));
  std::vector<std::string> warnings;
  surfaces_ = must(Surfaces::create(std::move(scene), warnings));
  tracer_ = with_coincident_rule(must(Tracer::create(surfaces_->scene(), *surfaces_, "avx2", 1)), *surfaces_);
  lights_ = must(Lights::create(*surfaces_, warnings, choice));
  for (const std::string& w : warnings) ADD_FAILURE() << w;
}

Integrator::Task ReadyScene::task(const TransportSettings& settings, uint32_t site, uint32_t sample) const {
  const SampleStream stream(settings.seed, atlas_.sites.texel[site], sample, settings.sampler);
  const SitePick pick = pick_site(atlas_, site, stream.single(0));
  return {surfaces_->at(pick.instance, pick.triangle, pick.b1, pick.b2), stream, {}};
}

ReadyScene::Estimate ReadyScene::mean_e(TransportSettings settings, uint32_t samples, uint32_t step) const {
  settings.sampler = Sampler::kRandom;  // independent samples: the stated error is no upper estimate
  const auto path = integrator(settings, features());
  const auto workspace = path->make_workspace();
  std::vector<Integrator::Task> tasks;
  Estimate e;
  double n = 0;
  for (uint32_t site = 0; site < texels(); site += step, ++n) {
    const MomentLayout layout(0);
    const ResponseSettings response;
    Film film(layout, response);
    for (uint32_t done = 0; done < samples; done += Integrator::kBatch) {
      tasks.clear();
      for (uint32_t k = 0; k < Integrator::kBatch; ++k) tasks.push_back(task(settings, site, done + k));
      path->sample(tasks, *workspace);
      for (const auto& t : tasks) EXPECT_TRUE(film.add(t.radiance, t.receiver.ns));
    }
    const double mean = film.sums()[kMomentLum] / samples;
    e.mean += mean;
    e.error += std::max(0.0, film.sums()[kMomentLum2] / samples - mean * mean) / (samples - 1);
  }
  return {e.mean / n, std::sqrt(e.error) / n};
}

}  // namespace kiln::test
