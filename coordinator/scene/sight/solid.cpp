#include "coordinator/scene/sight/solid.h"

#include <algorithm>

namespace kiln {
namespace {

bool is_positive(const Record& material, std::string_view name) {
  const Property* p = material.find(name);
  return p && std::any_of(p->numbers.begin(), p->numbers.end(), [](double v) { return v > 0; });
}

bool lets_light_through(const Record& material) {
  const Property* alpha = material.find("alpha_mode");
  return (alpha && alpha->word != "opaque") || is_positive(material, "transmission");
}

}  // namespace

Solid::Solid(const Scene& scene) {
  for (const Instance& instance : scene.instances) {
    const Record& material = scene.materials[instance.material];
    const bool through = lets_light_through(material);
    stops_.push_back(instance.cast && !through);
    two_sided_.push_back(through || is_positive(material, "double_sided"));
    emits_.push_back(instance.reflect && (is_positive(material, "emission") || material.type == "unlit"));
  }
}

Vec3 front_normal(const Mat4x3& to_world, const Vec3 (&c)[3]) {
  return normalize_or(transform_normal(to_world, cross(c[1] - c[0], c[2] - c[0])), Vec3(0, 1, 0));
}

}  // namespace kiln
