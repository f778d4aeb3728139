#include "common/probes/harmonics.h"

#include "common/probes/octahedral.h"

namespace kiln {
namespace {

constexpr uint32_t kSide = 16;  // of the octahedral map of normals that E is looked at for

Harmonics windowed(const Harmonics& light, float a) {
  Harmonics out = light;
  for (size_t k = 0; k < kHarmonics; ++k) {
    const auto l = static_cast<float>(kHarmonicDegree[k]);
    out[k] *= 1.0f / (1.0f + a * l * l * (l + 1) * (l + 1));
  }
  return out;
}

bool is_negative_somewhere(const Harmonics& light) {
  for (uint32_t t = 0; t < kSide * kSide; ++t) {
    const Vec3 e = harmonic_irradiance(light, octahedral_texel(t % kSide, t / kSide, kSide));
    if (std::min({e.x, e.y, e.z}) < 0.0f) return true;
  }
  return false;
}

}  // namespace

Harmonics without_ringing(const Harmonics& light) {
  constexpr float kMost = 10.0f;  // leaves a fortieth of degree 1: only light of less than nothing needs more
  if (!is_negative_somewhere(light)) return light;
  float low = 0, high = kMost;
  while (high - low > 1e-3f * high) {
    const float middle = 0.5f * (low + high);
    (is_negative_somewhere(windowed(light, middle)) ? low : high) = middle;
  }
  return windowed(light, high);
}

}  // namespace kiln
