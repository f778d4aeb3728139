// ROOM: add a material. One pair of files that parses its record and returns a Bsdf at a point, and one line
// in the roster below.
#pragma once

#include <concepts>
#include <string>
#include <variant>
#include <vector>

#include "common/scene/record_reader.h"
#include "common/scene/scene.h"
#include "worker/materials/bsdf.h"
#include "worker/materials/diffuse.h"
#include "worker/materials/metallic_roughness.h"
#include "worker/materials/unlit.h"

namespace kiln {

using Material = std::variant<MetallicRoughness, Unlit, Diffuse>;  // the roster

template <class M>
concept IsMaterial = requires(const M m, const Attributes& a, RecordReader& r, const Scene& s) {
  { M::kType } -> std::convertible_to<std::string_view>;
  { M::parse(r, s) } -> std::same_as<M>;
  { m.bsdf(a) } -> std::same_as<Bsdf>;
  { m.albedo(a) } -> std::same_as<Vec3>;    // bsdf(a).diffuse, if layers() is kLambert
  { m.emission(a) } -> std::same_as<Vec3>;  // radiance only, for sampling emitters
  { m.alpha() } -> std::same_as<const Alpha&>;
  { m.normal_map() } -> std::same_as<const NormalMap*>;  // or null
  { m.layers() } -> std::same_as<Layers>;
  { m.emission_parts() } -> std::same_as<EmissionParts>;
  { m.is_glass() } -> std::same_as<bool>;  // whether its Bsdf may transmit
  { m.is_emissive() } -> std::same_as<bool>;
  { m.double_sided() } -> std::same_as<bool>;
  {m.prefetch(a)};                           // hints that bsdf(a) follows soon
  { m.reads_uv(0u) } -> std::same_as<bool>;  // of a TEXCOORD set
};
static_assert(IsMaterial<MetallicRoughness> && IsMaterial<Unlit> && IsMaterial<Diffuse>);

// Appends unread properties of the record to `warnings`. Fails on unknown types.
Expected<Material> parse_material(const Record& record, const Scene& scene,
                                  std::vector<std::string>& warnings);

inline Bsdf bsdf_at(const Material& m, const Attributes& a) {
  return std::visit([&](const auto& x) { return x.bsdf(a); }, m);
}
inline Vec3 albedo_at(const Material& m, const Attributes& a) {
  return std::visit([&](const auto& x) { return x.albedo(a); }, m);
}
inline Vec3 emission_at(const Material& m, const Attributes& a) {
  return std::visit([&](const auto& x) { return x.emission(a); }, m);
}
inline EmissionParts emission_parts(const Material& m) {
  return std::visit([](const auto& x) { return x.emission_parts(); }, m);
}
inline const Alpha& alpha_of(const Material& m) {
  return std::visit([](const auto& x) -> const Alpha& { return x.alpha(); }, m);
}
inline const NormalMap* normal_map_of(const Material& m) {
  return std::visit([](const auto& x) { return x.normal_map(); }, m);
}
inline Layers layers_of(const Material& m) {
  return std::visit([](const auto& x) { return x.layers(); }, m);
}
// Whether its Bsdf may have more than a Lambert layer.
inline bool has_layers(const Material& m) {
  return layers_of(m) != Layers::kLambert;
}
inline float opacity_at(const Material& m, const Attributes& a) {
  return alpha_of(m).opacity(a);
}
inline bool is_opaque(const Material& m) {
  return alpha_of(m).is_opaque();
}
inline bool is_glass(const Material& m) {
  return std::visit([](const auto& x) { return x.is_glass(); }, m);
}
inline bool is_emissive(const Material& m) {
  return std::visit([](const auto& x) { return x.is_emissive(); }, m);
}
inline bool is_double_sided(const Material& m) {
  return std::visit([](const auto& x) { return x.double_sided(); }, m);
}
inline bool reads_uv(const Material& m, uint32_t set) {
  return std::visit([&](const auto& x) { return x.reads_uv(set); }, m);
}
inline void prefetch_textures(const Material& m, const Attributes& a) {
  std::visit([&](const auto& x) { x.prefetch(a); }, m);
}

}  // namespace kiln
