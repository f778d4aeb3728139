// ROOM: add a light. The roster of lights inside the scene, and what a type must provide to be
// listed.
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
  { Light::kType } -> std::convertible_to<std::string_view>;  // record type
  { Light::parse(r, record, scene) } -> std::same_as<Expected<Light>>;
  // Samples the light from a receiver at p. A delta light does not read `u` and leaves pdf at 0.
  { Light::kDelta } -> std::convertible_to<bool>;
  { l.sample(p, u) } -> std::same_as<LightSample>;
  { l.bounds() } -> std::same_as<LightBounds>;
  { l.power() } -> std::same_as<double>;  // luminance of the flux
  { l.bake } -> std::convertible_to<BakeMode>;
};

// Paths can also hit such a light. A ray that left p along a unit direction hits it at a distance from
// `origin` (infinite: never); sample() at p draws that direction with a density per steradian (0: never).
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
