// Every combination of layers, made as a file would make it.
#pragma once

#include "worker/materials/material.h"

namespace kiln::test {

struct LayeredMaterial {
  std::string name;
  Bsdf bsdf;  // of itself alone: its material is gone
};

inline Material material_of(std::vector<Property> properties) {
  const Scene scene;
  std::vector<std::string> warnings;
  const Record record{"metallic_roughness", "m", Mat4x3(1.0f), std::move(properties)};
  Material m = parse_material(record, scene, warnings).value();
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  return m;
}

// A number of a record, one component or three.
inline Property put(std::string name, std::vector<double> values) {
  return {std::move(name), std::move(values), "", {}};
}

// Base layers of one roughness, each bare, coated and with sheen; albedo as given.
inline std::vector<LayeredMaterial> layered_materials(double roughness, double albedo) {
  struct Base {
    const char* name;
    std::vector<Property> properties;
  };
  const std::vector<Base> bases = {{"Lambert", {put("metallic", {0}), put("specular", {0})}},
                                   {"dielectric", {put("metallic", {0})}},
                                   {"half metal", {put("metallic", {0.5})}},
                                   {"metal", {put("metallic", {1})}},
                                   {"dielectric of index 0", {put("metallic", {0}), put("ior", {0})}},
                                   {"half transmitting", {put("metallic", {0}), put("transmission", {0.5})}}};
  const std::vector<Base> covers = {
      {"", {}},
      {", coated", {put("clearcoat", {1}), put("clearcoat_roughness", {roughness})}},
      {", sheen", {put("sheen_color", {1, 0.8, 0.6}), put("sheen_roughness", {roughness})}},
      {", sheen, half coated",
       {put("sheen_color", {0.5, 0.5, 0.5}), put("sheen_roughness", {roughness}), put("clearcoat", {0.5})}}};
  std::vector<LayeredMaterial> out;
  for (const Base& base : bases)
    for (const Base& cover : covers) {
      std::vector<Property> p = base.properties;
      p.insert(p.end(), cover.properties.begin(), cover.properties.end());
      p.push_back(put("base_color", {albedo, albedo, albedo, 1}));
      p.push_back(put("roughness", {roughness}));
      const Material material = material_of(p);
      Bsdf bsdf = bsdf_at(material, {});
      bsdf.kept = nullptr;
      out.push_back({std::string(base.name) + cover.name, bsdf});
    }
  return out;
}

// White furnace: what comes back of radiance 1 from everywhere, plus what goes straight through. The number
// that chooses a lobe rises with the sample, so that each lobe gets a run of a low-discrepancy sequence
// (Roberts' R2).
inline double white_furnace(const Bsdf& bsdf, float cos, uint32_t samples) {
  const BsdfAtWo seen(bsdf, {std::sqrt(1.0f - cos * cos), 0.0f, cos});
  const auto number = [](uint32_t i, double step) {
    const double x = 0.5 + i * step;
    return static_cast<float>(std::min(x - std::floor(x), 1 - 0x1p-24));
  };
  double sum = 0;
  for (uint32_t i = 0; i < samples; ++i) {
    const float lobe = (static_cast<float>(i) + 0.5f) / static_cast<float>(samples);
    const Vec2 u(number(i, 0.7548776662466927), number(i, 0.5698402909980532));
    sum += static_cast<double>(max_component(seen.sample(lobe, u).weight));
  }
  return sum / samples + static_cast<double>(max_component(straight_through(bsdf, cos)));
}

// Unit, at this cosine to the normal.
inline Vec3 direction_at(float cos) {
  return {std::sqrt(1.0f - cos * cos), 0.0f, cos};
}

}  // namespace kiln::test
