// Layers that KHR_materials_* extensions add to metallic-roughness: transmission, volume, specular, clearcoat
// and sheen. Only materials that use any have this.
#pragma once

#include <memory>

#include "worker/materials/attributes.h"
#include "worker/materials/bsdf.h"

namespace kiln {

class ExtraLayers {
 public:
  // Null if the record has none of these.
  static std::shared_ptr<const ExtraLayers> parse(RecordReader& r, const Scene& scene);

  // Weight and colour of the dielectric layer, 1 without textures.
  float specular(const Attributes& a) const;
  Vec3 specular_color(const Attributes& a) const;
  // Share of the dielectric's light that is transmitted instead of diffusely reflected.
  float transmission(const Attributes& a) const;
  const Vec3& absorption() const { return absorption_; }
  // Sets the layers over the base.
  void cover(const Attributes& a, Bsdf& b) const;

  bool transmits() const { return transmission_ > 0.0f; }
  bool reads_uv(uint32_t set) const;

 private:
  float transmission_ = 0.0f, coat_ = 0.0f, coat_roughness_ = 0.0f, sheen_roughness_ = 0.0f;
  Vec3 absorption_{0.0f}, sheen_{0.0f};
  TextureSampler specular_texture_, specular_color_texture_, transmission_texture_;
  TextureSampler coat_texture_, coat_roughness_texture_, sheen_texture_, sheen_roughness_texture_;
};

}  // namespace kiln
