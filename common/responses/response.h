// ROOM: add a response. A response is a quantity that a texel accumulates from its primary rays: a few
// components, each a function of one sample. A unit result holds the sum of every component and of its
// square. Both are linear in the samples, so units of any cut, order and machine add up. `light` (irradiance
// and the basis) is the response that needs whole paths; those of this header need only the first ray.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"

namespace kiln {

// How occlusion falls off with the distance d to the occluder, for a maximum distance D.
enum class Falloff : uint32_t {
  kNone,    // 1 up to D
  kLinear,  // 1 - d/D
  kSmooth,  // 1 - t^2 (3 - 2t), t = d/D
};
constexpr uint32_t kFalloffs = 3;
std::string_view falloff_name(Falloff falloff);
Expected<Falloff> find_falloff(std::string_view name);

// Shared by all responses of a job.
struct ResponseSettings {
  float ao_distance = std::numeric_limits<float>::infinity();  // metres, > 0
  Falloff ao_falloff = Falloff::kNone;
};

// What the primary ray of a sample found.
struct PrimaryRay {
  Vec3 direction{0.0f};  // unit, world
  // cosine / (pi x density) at the shading normal; 0 where the direction lies below the geometric horizon
  // and no ray was traced. Its mean over the samples of an open sky is 1.
  float weight = 0.0f;
  // Metres to the surface that ended the ray, not counting glass passed; infinite if the ray escaped.
  float distance = std::numeric_limits<float>::infinity();
  // Luminance of the transmittance of the glass passed; 1 without glass.
  float transmittance = 1.0f;
  bool escaped() const { return distance == std::numeric_limits<float>::infinity(); }
};

// `components` are accumulated, `stored` are what resolve() computes from their means.
struct ResponseInfo {
  std::string_view name;  // in --quantities, and of its master and textures
  size_t components;
  std::span<const std::string_view> stored;  // channels of the master: "Y"; "X", "Y", "Z"
  bool is_signed;                            // stored values may be negative
  std::string_view about;
  // Stored values from the components' means, and their standard error (of the vector, if there are
  // several) from the components' errors. Called once, after the last merge.
  void (*resolve)(const float* means, float* stored);
  float (*standard_error)(const float* means, const float* errors);
};

constexpr size_t kMaxComponents = 4;

// For responses that store their means.
struct StoredAsIs {
  static void resolve(const float* means, float* stored) { stored[0] = means[0]; }
  static float standard_error(const float*, const float* errors) { return errors[0]; }
};

// Cosine-weighted share of the hemisphere without an occluder closer than ao_distance. [0, 1].
struct AmbientOcclusion : StoredAsIs {
  static constexpr size_t kComponents = 1;
  static constexpr std::array<std::string_view, 1> stored{"Y"};
  static constexpr std::string_view name = "ao", about = "ambient occlusion: the unoccluded share";
  static constexpr bool is_signed = false;
  static void evaluate(const PrimaryRay& ray, const ResponseSettings& s, float* out) {
    float occlusion = 0.0f;
    if (ray.distance < s.ao_distance) {
      const float t = ray.distance / s.ao_distance;
      occlusion = s.ao_falloff == Falloff::kNone     ? 1.0f
                  : s.ao_falloff == Falloff::kLinear ? 1.0f - t
                                                     : 1.0f - t * t * (3.0f - 2.0f * t);
    }
    out[0] = ray.weight * ray.transmittance * (1.0f - occlusion);
  }
};

// Cosine-weighted share of the hemisphere that sees the sky; alpha masks, blending and glass count
// by their transmittance. [0, 1]: a sky of constant radiance L gives E = pi L sky.
struct SkyVisibility : StoredAsIs {
  static constexpr size_t kComponents = 1;
  static constexpr std::array<std::string_view, 1> stored{"Y"};
  static constexpr std::string_view name = "sky", about = "sky visibility: the share of the sky that is seen";
  static constexpr bool is_signed = false;
  static void evaluate(const PrimaryRay& ray, const ResponseSettings&, float* out) {
    out[0] = ray.escaped() ? ray.weight * ray.transmittance : 0.0f;
  }
};

// Mean direction from which the sky is seen, weighted like SkyVisibility, in world axes: stored as a unit
// vector times the sky visibility, 0 where no sky is seen. Components: X, Y, Z and the sky visibility.
struct BentNormal {
  static constexpr size_t kComponents = 4;
  static constexpr std::array<std::string_view, 3> stored{"X", "Y", "Z"};
  static constexpr std::string_view name = "bent", about = "bent normal times sky visibility, world axes";
  static constexpr bool is_signed = true;
  static void evaluate(const PrimaryRay& ray, const ResponseSettings&, float* out) {
    const float w = ray.escaped() ? ray.weight * ray.transmittance : 0.0f;
    out[0] = w * ray.direction.x;
    out[1] = w * ray.direction.y;
    out[2] = w * ray.direction.z;
    out[3] = w;
  }
  static void resolve(const float* means, float* stored) {
    const Vec3 m(means[0], means[1], means[2]);
    const float length = std::sqrt(dot(m, m)), scale = length > 0.0f ? means[3] / length : 0.0f;
    for (int c = 0; c < 3; ++c) stored[c] = m[c] * scale;
  }
  // To first order: the error of the length, and the rotation of the direction times the length.
  // Errors along the vector do not rotate it, so this is an upper estimate.
  static float standard_error(const float* means, const float* errors) {
    const Vec3 m(means[0], means[1], means[2]), e(errors[0], errors[1], errors[2]);
    const float square = dot(m, m), turn = square > 0.0f ? means[3] * means[3] / square * dot(e, e) : 0.0f;
    return std::sqrt(errors[3] * errors[3] + turn);
  }
};

// A list of response types, with what code that loops over them needs.
template <class... Response>
struct ResponseRoster {
  static std::span<const ResponseInfo> all() {
    static const std::array<ResponseInfo, sizeof...(Response)> infos{
        ResponseInfo{Response::name, Response::kComponents, Response::stored, Response::is_signed,
                     Response::about, Response::resolve, Response::standard_error}...};
    static_assert(((Response::kComponents <= kMaxComponents && Response::stored.size() <= 3) && ...));
    return infos;
  }
  template <class One>
  static constexpr uint32_t index_of() {
    uint32_t i = 0, found = sizeof...(Response);
    ((std::is_same_v<One, Response> ? void(found = i) : void(), ++i), ...);
    return found;
  }
  // Adds the components of response `index` and their squares to sums[0 .. 2 x components).
  static void accumulate(uint32_t index, const PrimaryRay& ray, const ResponseSettings& s, double* sums) {
    uint32_t i = 0;
    ((i++ == index ? add<Response>(ray, s, sums) : void()), ...);
  }

 private:
  template <class One>
  static void add(const PrimaryRay& ray, const ResponseSettings& s, double* sums) {
    float value[kMaxComponents];
    One::evaluate(ray, s, value);
    for (size_t c = 0; c < One::kComponents; ++c) {
      sums[2 * c] += value[c];
      sums[2 * c + 1] += double{value[c]} * value[c];
    }
  }
};
using Responses = ResponseRoster<AmbientOcclusion, SkyVisibility, BentNormal>;  // add a response here

std::span<const ResponseInfo> response_roster();
// Plane of a stored value: "ao", or "bent.X" where there are several.
std::string response_plane(const ResponseInfo& response, size_t stored);

}  // namespace kiln
