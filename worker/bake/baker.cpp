#include "worker/bake/baker.h"

#include "common/atlas/site_picker.h"
#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "worker/bake/film.h"

namespace kiln {
namespace {

class PathBaker final : public Baker {
 public:
  PathBaker(Atlas atlas, const TransportSettings& settings) : atlas_(std::move(atlas)), settings_(settings) {}

  Status build(Scene scene, unsigned threads) {
    KILN_TRY(surfaces_, Surfaces::create(std::move(scene), warnings_));
    KILN_TRY(tracer_, Tracer::create(surfaces_->scene(), *surfaces_, settings_.isa, threads));
    KILN_TRY(lights_, Lights::create(*surfaces_, warnings_));
    integrator_ =
        Integrator::create(*surfaces_, *tracer_, lights_, settings_, find_features(*surfaces_, lights_));
    return {};
  }

  std::vector<std::string> warnings() const override { return warnings_; }

  Expected<UnitResult> bake(const WorkUnit& unit) const override {
    const Stopwatch watch;
    Film film(settings_.basis);
    UnitResult result;
    result.unit = unit.id;
    result.site_count = static_cast<uint32_t>(unit.sites.size());
    result.plane_count = static_cast<uint32_t>(film.planes());
    result.moments.reserve(unit.sites.size() * film.planes());
    for (uint32_t site : unit.sites) {
      if (site >= atlas_.sites.size())
        return fail(ErrorKind::kInvalidInput, text("unit {} names texel site {}, and there are {}", unit.id,
                                                   site, atlas_.sites.size()));
      film.clear();
      const uint32_t texel = atlas_.sites.texel[site];
      SitePicker picker(atlas_, surfaces_->scene(), site);
      for (uint32_t done = 0; done < unit.sample_count; done += kBatch)
        sample(picker, texel, unit.first_sample + done, std::min(kBatch, unit.sample_count - done), film,
               result);
      result.moments.insert(result.moments.end(), film.sums().begin(), film.sums().begin() + film.planes());
    }
    result.seconds = watch.seconds();
    return result;
  }

 private:
  static constexpr uint32_t kBatch = Integrator::kBatch;

  // Samples [first, first + count) of one texel, added in their order.
  void sample(SitePicker& picker, uint32_t texel, uint32_t first, uint32_t count, Film& film,
              UnitResult& result) const {
    Integrator::Task tasks[kBatch];
    for (uint32_t i = 0; i < count; ++i) {
      const SampleStream stream(settings_.seed, texel, first + i, settings_.sampler);
      const SitePick pick = picker.pick(stream.single(0));
      tasks[i] = {surfaces_->at(pick.instance, pick.triangle, pick.b1, pick.b2), stream, {}};
    }
    integrator_->sample(std::span(tasks, count));
    for (uint32_t i = 0; i < count; ++i) {
      result.rays += tasks[i].splats.rays;
      if (!film.add(tasks[i].splats, tasks[i].receiver.ns) && result.nonfinite++ == 0) {
        result.nonfinite_texel = texel;
        result.nonfinite_sample = first + i;
      }
    }
  }

  Atlas atlas_;
  TransportSettings settings_;
  std::vector<std::string> warnings_;
  std::unique_ptr<Surfaces> surfaces_;
  std::unique_ptr<Tracer> tracer_;
  Lights lights_;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace

Expected<std::unique_ptr<Baker>> Baker::create(Scene scene, Atlas atlas, const TransportSettings& settings,
                                               unsigned threads) {
  if (settings.basis >= basis_roster().size())
    return fail(ErrorKind::kInvalidInput, text("basis {} does not exist in this worker", settings.basis));
  auto baker = std::make_unique<PathBaker>(std::move(atlas), settings);
  KILN_TRY_STATUS(baker->build(std::move(scene), threads));
  return std::unique_ptr<Baker>(std::move(baker));
}

}  // namespace kiln
