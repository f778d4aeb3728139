// ROOM: add a receiver. Receivers are the places that gather light; units of work index them. A kind of
// receivers is one class as ReceiverKind says, and its line in Baker::create.
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
#include "worker/integrators/known_irradiance.h"
#include "worker/sites/places.h"

namespace kiln {

template <class R>
concept ReceiverKind = requires(const R& r, typename R::Open& open, const Surfaces& surfaces,
                                const Tracer& tracer, const SampleStream& stream, uint64_t& rays,
                                const IrradianceCache& cache) {
  { r.size() } -> std::convertible_to<size_t>;
  // What the random numbers of a receiver depend on, and the name under which non-finite samples are
  // reported.
  { r.key(0u) } -> std::same_as<uint32_t>;
  // A receiver while samples are taken of it: the point and normal of a sample, and another place for one
  // whose primary ray met a back face, if there is one.
  typename R::Open;
  requires std::constructible_from<typename R::Open, const R&, const Surfaces&, const Tracer&, uint32_t>;
  { open.at(stream) } -> std::same_as<SurfacePoint>;
  { open.instead_of(stream, rays) } -> std::same_as<std::optional<SitePlaces::Place>>;
  // Where paths may end at the irradiance of a cache; asked only by units that name one.
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

  // The lookup is made by the first unit that asks: only a job with irradiance caches needs it.
  std::optional<KnownIrradiance> known(const Scene& scene, const IrradianceCache& cache) const {
    std::call_once(state_->lookup_made, [&] { state_->lookup.emplace(atlas_, scene); });
    return KnownIrradiance{*state_->lookup, cache};
  }

 private:
  struct State {
    std::vector<std::atomic<bool>> hopeless;  // by site: no place outside (SitePlaces)
    std::once_flag lookup_made;
    std::optional<SiteLookup> lookup;
  };
  Atlas atlas_;
  std::unique_ptr<State> state_;
};
static_assert(ReceiverKind<TexelReceivers>);

}  // namespace kiln
