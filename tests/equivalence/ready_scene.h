// A scene ready for integrators of every kind, with receivers: the sites of its lightmap.
#pragma once

#include "common/atlas/atlas.h"
#include "worker/integrators/integrator.h"

namespace kiln::test {

class ReadyScene {
 public:
  explicit ReadyScene(Scene scene, LightChoice choice = LightChoice::kTree);

  std::unique_ptr<Integrator> integrator(const TransportSettings& settings, uint32_t features) const {
    return Integrator::create(*surfaces_, *tracer_, lights_, settings, features);
  }
  uint32_t features() const { return find_features(*surfaces_, lights_); }
  size_t texels() const { return atlas_.sites.size(); }

  // A sample of a texel, not yet taken.
  Integrator::Task task(const TransportSettings& settings, uint32_t site, uint32_t sample) const;

  // Luminance of E, mean over every `step`-th texel, with the error that its independent samples state.
  struct Estimate {
    double mean = 0, error = 0;
  };
  Estimate mean_e(TransportSettings settings, uint32_t samples, uint32_t step) const;

 private:
  std::unique_ptr<Surfaces> surfaces_;
  std::unique_ptr<Tracer> tracer_;
  Lights lights_;
  Atlas atlas_;
};

}  // namespace kiln::test
