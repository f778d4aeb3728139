// Bakes receivers of any kind: points, paths, sums.
#pragma once

#include <algorithm>
#include <optional>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "worker/bake/baker.h"
#include "worker/bake/receivers.h"
#include "worker/bake/recentre.h"
#include "worker/surface/coincident.h"

namespace kiln {

// Units index the receivers; receivers.h defines the concept.
template <ReceiverKind Receivers>
class PathBaker final : public Baker {
 public:
  PathBaker(Receivers receivers, const TransportSettings& settings)
      : receivers_(std::move(receivers)), settings_(settings), layout_(settings.basis, settings.quantities) {}

  Status build(Scene scene, unsigned threads) {
    const Vec3 offset = recentre(scene);
    if constexpr (requires { receivers_.move(offset); }) receivers_.move(-offset);
    KILN_TRY(surfaces_, Surfaces::create(std::move(scene), warnings_));
    KILN_TRY(auto tracer,
             Tracer::create(surfaces_->scene(), *surfaces_, settings_.isa, threads, settings_.watertight));
    tracer_ = with_coincident_rule(std::move(tracer), *surfaces_);
    if (settings_.quantities.light) {
      KILN_TRY(lights_, Lights::create(*surfaces_, warnings_));
    }
    integrator_ =
        Integrator::create(*surfaces_, *tracer_, lights_, settings_, find_features(*surfaces_, lights_));
    return {};
  }

  std::vector<std::string> warnings() const override { return warnings_; }
  size_t sites() const override { return receivers_.size(); }

  Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache) const override {
    const Stopwatch watch;
    if (cache && cache->irradiance.size() != receivers_.size())
      return fail(ErrorKind::kInvalidInput,
                  text("unit {} has an irradiance cache of {} texel sites, and there are {}", unit.id,
                       cache->irradiance.size(), receivers_.size()));
    const std::optional<KnownIrradiance> known =
        cache ? receivers_.known(surfaces_->scene(), *cache) : std::nullopt;
    Run run{{}, integrator_->make_workspace(), {}, known ? &*known : nullptr, {}};
    UnitResult& result = run.result;
    result.unit = unit.id;
    result.site_count = static_cast<uint32_t>(unit.sites.size());
    result.plane_count = static_cast<uint32_t>(layout_.planes());
    result.moments.reserve(unit.sites.size() * result.plane_count);
    for (uint32_t site : unit.sites)
      if (site >= receivers_.size())
        return fail(ErrorKind::kInvalidInput,
                    text("unit {} names texel site {}, and there are {}", unit.id, site, receivers_.size()));
    // Receivers of few samples share a batch.
    const size_t together = std::max(1u, kBatch / std::max(1u, unit.sample_count));
    run.films.assign(together, Sums(layout_, settings_.response));
    for (size_t begin = 0; begin < unit.sites.size(); begin += together)
      bake_receivers(unit, begin, std::min(unit.sites.size(), begin + together), run);
    result.seconds = watch.seconds();
    return std::move(result);
  }

 private:
  static constexpr uint32_t kBatch = Integrator::kBatch;
  using Sums = typename Receivers::Sums;

  // A unit being baked.
  struct Run {
    std::vector<Sums> films;  // one per receiver of a batch
    std::unique_ptr<Integrator::Workspace> workspace;
    UnitResult result;
    const KnownIrradiance* known;
    Integrator::Task tasks[kBatch];
  };
  struct Receiver {
    uint32_t key;
    typename Receivers::Open points;
  };

  // Takes the unit's samples of sites [begin, end); each receiver's are added in their order.
  void bake_receivers(const WorkUnit& unit, size_t begin, size_t end, Run& run) const {
    std::vector<Receiver> receivers;
    receivers.reserve(end - begin);
    for (size_t i = begin; i < end; ++i)
      receivers.push_back({receivers_.key(unit.sites[i]),
                           typename Receivers::Open(receivers_, *surfaces_, *tracer_, unit.sites[i])});
    for (Sums& film : run.films) film.clear();
    if constexpr (requires { receivers[0].points.reach(); })
      for (size_t t = 0; t < receivers.size(); ++t) run.films[t].set_reach(receivers[t].points.reach());
    const uint32_t step = kBatch / static_cast<uint32_t>(receivers.size());
    for (uint32_t done = 0; done < unit.sample_count; done += step)
      sample(receivers, replicate_seed(settings_.seed, unit.replicate, unit.take), unit.first_sample + done,
             std::min(step, unit.sample_count - done), run);
    std::vector<double>& moments = run.result.moments;
    for (size_t t = 0; t < receivers.size(); ++t) {
      const Sums& film = run.films[t];
      moments.insert(moments.end(), film.sums().begin(), film.sums().end());
    }
  }

  // Samples that met a back face, from a site inside geometry, are taken again from outside. That is decided
  // for each sample by itself, so that no cut of a receiver's samples into ranges changes any of them.
  void take_again(Receiver& receiver, std::span<Integrator::Task> tasks, Sums& film, Run& run) const {
    Integrator::Task again[kBatch];
    size_t from[kBatch], count = 0;
    for (size_t i = 0; i < tasks.size(); ++i) {
      if (!tasks[i].radiance.inside) continue;
      const std::optional<SitePlaces::Place> place =
          receiver.points.instead_of(tasks[i].stream, run.result.rays);
      if (!place) continue;
      again[count] = {place->point, tasks[i].stream, {}};
      again[count].radiance.rays = tasks[i].radiance.rays;
      from[count++] = i;
      if (place->moved) film.count_pushed();
    }
    if (count == 0) return;
    integrator_->sample(std::span(again, count), *run.workspace, run.known);
    for (size_t k = 0; k < count; ++k) tasks[from[k]] = again[k];
  }

  // Takes samples [first, first + count) of some receivers, at most kBatch in all.
  void sample(std::span<Receiver> receivers, uint64_t seed, uint32_t first, uint32_t count, Run& run) const {
    UnitResult& result = run.result;
    Integrator::Task* const tasks = run.tasks;
    size_t next = 0;
    for (Receiver& receiver : receivers)
      for (uint32_t i = 0; i < count; ++i) {
        const SampleStream stream(seed, receiver.key, first + i, settings_.sampler);
        ::new (&tasks[next++]) Integrator::Task{receiver.points.at(stream), stream, {}};
      }
    integrator_->sample(std::span(tasks, next), *run.workspace, run.known);
    for (size_t t = 0; t < receivers.size(); ++t) {
      const std::span<Integrator::Task> own(tasks + t * count, count);
      Sums& film = run.films[t];
      if (std::any_of(own.begin(), own.end(), [](const auto& task) { return task.radiance.inside; }))
        take_again(receivers[t], own, film, run);
      for (uint32_t i = 0; i < count; ++i) {
        result.rays += own[i].radiance.rays;
        if (!film.add(own[i].radiance, own[i].receiver.ns) && result.nonfinite++ == 0) {
          result.nonfinite_texel = receivers[t].key;
          result.nonfinite_sample = first + i;
        }
      }
    }
  }

  Receivers receivers_;
  TransportSettings settings_;
  MomentLayout layout_;
  std::vector<std::string> warnings_;
  std::unique_ptr<Surfaces> surfaces_;
  std::unique_ptr<Tracer> tracer_;
  Lights lights_;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace kiln
