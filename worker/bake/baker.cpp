#include "worker/bake/baker.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "common/atlas/site_picker.h"
#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "worker/bake/film.h"
#include "worker/bake/recentre.h"
#include "worker/sites/places.h"
#include "worker/surface/coincident.h"

namespace kiln {
namespace {

class PathBaker final : public Baker {
 public:
  PathBaker(Atlas atlas, const TransportSettings& settings) : atlas_(std::move(atlas)), settings_(settings) {}

  Status build(Scene scene, unsigned threads) {
    recentre(scene);
    KILN_TRY(surfaces_, Surfaces::create(std::move(scene), warnings_));
    KILN_TRY(auto tracer,
             Tracer::create(surfaces_->scene(), *surfaces_, settings_.isa, threads, settings_.watertight));
    tracer_ = with_coincident_rule(std::move(tracer), *surfaces_);
    KILN_TRY(lights_, Lights::create(*surfaces_, warnings_));
    integrator_ =
        Integrator::create(*surfaces_, *tracer_, lights_, settings_, find_features(*surfaces_, lights_));
    return {};
  }

  std::vector<std::string> warnings() const override { return warnings_; }
  size_t sites() const override { return atlas_.sites.size(); }

  Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache) const override {
    const Stopwatch watch;
    std::optional<KnownIrradiance> known;
    if (cache) {
      if (cache->irradiance.size() != atlas_.sites.size())
        return fail(ErrorKind::kInvalidInput,
                    text("unit {} has an irradiance cache of {} texel sites, and there are {}", unit.id,
                         cache->irradiance.size(), atlas_.sites.size()));
      known.emplace(KnownIrradiance{lookup(), *cache});
    }
    Run run{Film(settings_.basis), integrator_->make_workspace(), {}, known ? &*known : nullptr};
    Film& film = run.film;
    UnitResult& result = run.result;
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
      Texel of{texel, SitePicker(atlas_, site), SitePlaces(*surfaces_, *tracer_)};
      for (uint32_t done = 0; done < unit.sample_count; done += kBatch)
        sample(of, unit.replicate, unit.first_sample + done, std::min(kBatch, unit.sample_count - done), run);
      result.moments.insert(result.moments.end(), film.sums().begin(), film.sums().begin() + film.planes());
    }
    result.seconds = watch.seconds();
    return std::move(result);
  }

 private:
  static constexpr uint32_t kBatch = Integrator::kBatch;

  // A unit in work.
  struct Run {
    Film film;
    std::unique_ptr<Integrator::Workspace> workspace;
    UnitResult result;
    const KnownIrradiance* known;
  };
  struct Texel {
    uint32_t index;
    SitePicker picker;
    SitePlaces places;
  };

  // Samples that met a back face, from a site inside geometry, are taken again from outside. That is decided
  // for each sample by itself, so that no cut of a texel's samples into ranges changes any of them.
  void take_again(Texel& texel, std::span<Integrator::Task> tasks, Run& run) const {
    Integrator::Task again[kBatch];
    size_t from[kBatch], count = 0;
    for (size_t i = 0; i < tasks.size(); ++i) {
      if (!tasks[i].splats.inside) continue;
      const std::optional<SitePlaces::Place> place = texel.places.instead_of(
          texel.picker, texel.picker.index(tasks[i].stream.single(0)), run.result.rays);
      if (!place) continue;
      again[count] = {place->point, tasks[i].stream, {}};
      again[count].splats.rays = tasks[i].splats.rays;
      from[count++] = i;
      if (place->moved) run.film.count_pushed();
    }
    if (count == 0) return;
    integrator_->sample(std::span(again, count), *run.workspace, run.known);
    for (size_t k = 0; k < count; ++k) tasks[from[k]] = again[k];
  }

  // Made by the first unit that asks: only a job with irradiance caches needs it.
  const SiteLookup& lookup() const {
    std::call_once(lookup_made_, [&] { lookup_.emplace(atlas_, surfaces_->scene()); });
    return *lookup_;
  }

  // Samples [first, first + count) of one texel, added in their order.
  void sample(Texel& texel, uint32_t replicate, uint32_t first, uint32_t count, Run& run) const {
    UnitResult& result = run.result;
    const uint64_t seed = replicate_seed(settings_.seed, replicate);
    Integrator::Task tasks[kBatch];
    for (uint32_t i = 0; i < count; ++i) {
      const SampleStream stream(seed, texel.index, first + i, settings_.sampler);
      const SitePick pick = texel.picker.pick(stream.single(0));
      tasks[i] = {surfaces_->at(pick.instance, pick.triangle, pick.b1, pick.b2), stream, {}};
    }
    integrator_->sample(std::span(tasks, count), *run.workspace, run.known);
    if (std::any_of(tasks, tasks + count, [](const auto& t) { return t.splats.inside; }))
      take_again(texel, std::span(tasks, count), run);
    for (uint32_t i = 0; i < count; ++i) {
      result.rays += tasks[i].splats.rays;
      if (!run.film.add(tasks[i].splats, tasks[i].receiver.ns) && result.nonfinite++ == 0) {
        result.nonfinite_texel = texel.index;
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
  mutable std::once_flag lookup_made_;
  mutable std::optional<SiteLookup> lookup_;
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
