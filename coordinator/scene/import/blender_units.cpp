#include "coordinator/scene/import/blender_units.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/scene/import/materials.h"

namespace kiln {
namespace {

constexpr double kLumensPerWatt = 683;
// In the file's units; in Blender they would be a sun of 0.15 W/m2 and a lamp of 9 W.
constexpr double kBrightSun = 100, kBrightLamp = 500;

// Whether a person would type this number: at most `digits` digits.
bool is_round(double value, int digits) {
  if (!(value >= 1e-3)) return false;
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - (digits - 1));
  return std::abs(value / unit - std::round(value / unit)) < 1e-5 * (value / unit);
}

// The exporter's input if the lamp is in lumens: W/m2 for a sun, W for others.
double watts_of(const Record& light, double intensity) {
  return light.type == "directional" ? intensity / kLumensPerWatt
                                     : intensity / (kLumensPerWatt / (4 * 3.14159265358979323846));
}

bool looks_like_lumens(const Record& light, bool blender) {
  if (light.type != "directional" && light.type != "point" && light.type != "spot") return false;
  const double intensity = light.find("intensity")->numbers[0];
  const bool bright = intensity >= (light.type == "directional" ? kBrightSun : kBrightLamp);
  return bright && (blender || is_round(watts_of(light, intensity), 2));
}

// Describes emitters other than lamps; empty: none.
std::string other_light(const Scene& scene) {
  for (const Record& material : scene.materials)
    if (emits(material)) return text("the emission of material '{}'", material.name);
  for (const Record& light : scene.lights)
    if (light.type == "environment") return "the environment";
  return {};
}

}  // namespace

void warn_of_lumens(const ImportContext& context, const Scene& scene, ImportNotes& notes) {
  const bool blender = context.model.generator.find("Khronos glTF Blender I/O") != std::string::npos;
  const std::string other = other_light(scene);
  if (other.empty()) return;
  const auto at = std::find_if(scene.lights.begin(), scene.lights.end(),
                               [&](const Record& l) { return looks_like_lumens(l, blender); });
  if (at == scene.lights.end()) return;
  const double intensity = at->find("intensity")->numbers[0];
  const bool sun = at->type == "directional";
  add_note(
      notes, ImportNote::Kind::kWarning,
      text("lamps are in lumens and {} is not: '{}' has {:.6g} {}, {:.4g} {} times {}, as Blender exports by "
           "default, so that the lamps are 683 times too bright beside it. Export again with Lighting > "
           "Lighting Mode: Unitless, or divide the lamps by 683",
           other, at->name, intensity, sun ? "lux" : "candela", watts_of(*at, intensity), sun ? "W/m2" : "W",
           sun ? "683" : "683 / (4 pi)"));
}

}  // namespace kiln
