// ROOM: add a receiver. Receivers are the places that gather light; units of work index them. A
// kind of receiver is one class that models ReceiverKind, and one line in Baker::create.
#pragma once

#include <atomic>
#include <concepts>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/atlas/site_picker.h"
#include "common/math/sequence.h"
#include "worker/bake/film.h"
#include "worker/integrators/known_irradiance.h"
#include "worker/sites/places.h"

namespace kiln {

template <class R>
concept ReceiverKind = requires(const R& r, typename R::Open& open, const Surfaces& surfaces,
                                const Tracer& tracer, const SampleStream& stream, uint64_t& rays,
                                const IrradianceCache& cache) {
  { r.size() } -> std::convertible_to<size_t>;
  // The key of a receiver's random numbers, also the name under which non-finite samples are
  // reported.
  { r.key(0u) } -> std::same_as<uint32_t>;
  // Its sums: Film, or one of another kind with the same functions.
  typename R::Sums;
  // A receiver while it is sampled: the point and normal of a sample, and a replacement point, if
  // there is one, for a sample whose primary ray hit a back face.
  typename R::Open;
  requires std::constructible_from<typename R::Open, const R&, const Surfaces&, const Tracer&, uint32_t>;
  { open.at(stream) } -> std::same_as<SurfacePoint>;
  { open.instead_of(stream, rays) } -> std::same_as<std::optional<SitePlaces::Place>>;
  // Where paths may end at cached irradiance; called only by units that name a cache.
  { r.known(surfaces.scene(), cache) } -> std::same_as<std::optional<KnownIrradiance>>;
};

// Texel sites of an atlas.
class TexelReceivers {
 public:
  explicit TexelReceivers(Atlas atlas) : atlas_(std::move(atlas)), state_(std::make_unique<State>()) {
    state_->hopeless = std::vector<std::atomic<bool>>(atlas_.sites.size());
  }
  size_t size() const { return atlas_.sites.size(); }
  uint32_t key(uint32_t index) const { return atlas_.sites.texel[index]; }
  using Sums = Film;

  class Open {
   public:
    Open(const TexelReceivers& r, const Surfaces& surfaces, const Tracer& tracer, uint32_t index)
        : surfaces_(&surfaces),
          picker_(r.atlas_, index),
          places_(surfaces, tracer, r.state_->hopeless[index]) {}
    SurfacePoint at(const SampleStream& stream) {
      const SitePick pick = picker_.pick(stream.single(0));
      return surfaces_->at(pick.instance, pick.triangle, pick.b1, pick.b2);
    }
    std::optional<SitePlaces::Place> instead_of(const SampleStream& stream, uint64_t& rays) {
      return places_.instead_of(picker_, picker_.index(stream.single(0)), rays);
    }

   private:
    const Surfaces* surfaces_;
    SitePicker picker_;
    SitePlaces places_;
  };

  // Built by the first unit that asks: only jobs with irradiance caches need it.
  std::optional<KnownIrradiance> known(const Scene& scene, const IrradianceCache& cache) const {
    std::call_once(state_->lookup_made, [&] { state_->lookup.emplace(atlas_, scene); });
    return KnownIrradiance{*state_->lookup, cache};
  }

 private:
  struct State {
    std::vector<std::atomic<bool>> hopeless;  // by site: no usable point outside (SitePlaces)
    std::once_flag lookup_made;
    std::optional<SiteLookup> lookup;
  };
  Atlas atlas_;
  std::unique_ptr<State> state_;
};
static_assert(ReceiverKind<TexelReceivers>);

}  // namespace kiln
