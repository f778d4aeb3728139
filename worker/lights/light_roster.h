// ROOM: add a light. The roster of lights inside the scene, and what a type of light has to be to stand in
// it.
#pragma once

#include <concepts>
#include <string_view>
#include <variant>

#include "worker/lights/disc_light.h"
#include "worker/lights/ies.h"
#include "worker/lights/punctual.h"
#include "worker/lights/rect_light.h"

namespace kiln {

// clang-format off
template <class Light>
concept IsLight = requires(const Light& l, RecordReader& r, const Record& record, const Scene& scene,
                           const Vec3& p, const Vec2& u) {
  { Light::kType } -> std::convertible_to<std::string_view>;  // of its records
  { Light::parse(r, record, scene) } -> std::same_as<Expected<Light>>;
  // Towards the light from a receiver at p. A delta light reads no `u` and leaves pdf at 0.
  { Light::kDelta } -> std::convertible_to<bool>;
  { l.sample(p, u) } -> std::same_as<LightSample>;
  { l.bounds() } -> std::same_as<LightBounds>;
  { l.power() } -> std::same_as<double>;  // luminance of the flux
  { l.bake } -> std::convertible_to<BakeMode>;
};

// Paths meet such a light as well: a ray that left p along a unit direction does so at a distance from `origin`
// (infinite: never), and sample() at p takes that direction with a density (per steradian; 0: it cannot).
template <class Light>
concept IsAreaLight = IsLight<Light> && !Light::kDelta &&
                      requires(const Light& l, const Vec3& p, const Vec3& origin,
                               const Vec3& direction) {
  { l.distance(p, origin, direction) } -> std::same_as<double>;
  { l.pdf(p, direction) } -> std::same_as<float>;
  { l.radiance() } -> std::convertible_to<Vec3>;
};
// clang-format on

template <class... Lights>
requires((IsLight<Lights> && (Lights::kDelta || IsAreaLight<Lights>)) &&
         ...) using LightRoster = std::variant<Lights...>;

using AnyLight = LightRoster<PointLight, SpotLight, IesLight, RectLight, DiscLight>;

}  // namespace kiln
