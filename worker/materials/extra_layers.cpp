#include "worker/materials/extra_layers.h"

namespace kiln {

std::shared_ptr<const ExtraLayers> ExtraLayers::parse(RecordReader& r, const Scene& scene) {
  ExtraLayers e;
  const auto texture = [&](const char* name) { return TextureSampler(scene, r.texture(name)); };
  e.specular_texture_ = texture("specular_texture");
  e.specular_color_texture_ = texture("specular_color_texture");
  e.transmission_ = within(r.number("transmission", 0.0f), 0.0f, 1.0f);
  e.transmission_texture_ = texture("transmission_texture");
  e.absorption_ = within(r.vec3("absorption", Vec3(0.0f)), 0.0f, 1e9f);
  e.coat_ = within(r.number("clearcoat", 0.0f), 0.0f, 1.0f);
  e.coat_roughness_ = within(r.number("clearcoat_roughness", 0.0f), 0.0f, 1.0f);
  e.coat_texture_ = texture("clearcoat_texture");
  e.coat_roughness_texture_ = texture("clearcoat_roughness_texture");
  e.sheen_ = within(r.vec3("sheen_color", Vec3(0.0f)), 0.0f, 1.0f);
  e.sheen_roughness_ = within(r.number("sheen_roughness", 0.0f), 0.0f, 1.0f);
  e.sheen_texture_ = texture("sheen_color_texture");
  e.sheen_roughness_texture_ = texture("sheen_roughness_texture");
  const bool any = e.specular_texture_ || e.specular_color_texture_ || e.transmission_ > 0.0f ||
                   e.coat_ > 0.0f || max_component(e.sheen_) > 0.0f;
  return any ? std::make_shared<const ExtraLayers>(std::move(e)) : nullptr;
}

float ExtraLayers::specular(const Attributes& a) const {
  return specular_texture_ ? specular_texture_.color(a.uv).x : 1.0f;
}
Vec3 ExtraLayers::specular_color(const Attributes& a) const {
  return specular_color_texture_ ? specular_color_texture_.color(a.uv) : Vec3(1.0f);
}
float ExtraLayers::transmission(const Attributes& a) const {
  return transmission_texture_ ? transmission_ * transmission_texture_.color(a.uv).x : transmission_;
}

void ExtraLayers::cover(const Attributes& a, Bsdf& b) const {
  if (coat_ > 0.0f) {
    b.coat = coat_texture_ ? coat_ * coat_texture_.color(a.uv).x : coat_;
    b.coat_alpha = ggx_alpha(coat_roughness_texture_ ? coat_roughness_ * coat_roughness_texture_.color(a.uv).y
                                                     : coat_roughness_);
  }
  b.sheen = sheen_texture_ ? sheen_ * sheen_texture_.color(a.uv) : sheen_;
  b.sheen_roughness =
      sheen_roughness_texture_ ? sheen_roughness_ * sheen_roughness_texture_.color(a.uv).x : sheen_roughness_;
}

bool ExtraLayers::reads_uv(uint32_t set) const {
  for (const TextureSampler* t :
       {&specular_texture_, &specular_color_texture_, &transmission_texture_, &coat_texture_,
        &coat_roughness_texture_, &sheen_texture_, &sheen_roughness_texture_})
    if (t->reads_uv(set)) return true;
  return false;
}

}  // namespace kiln
