#include "worker/materials/diffuse.h"

namespace kiln {

Diffuse Diffuse::parse(RecordReader& r, const Scene& scene) {
  Diffuse m;
  const Vec4 base = r.vec4("base_color", Vec4(1.0f));
  m.base_color_ = within(Vec3(base), 0.0f, 1.0f);
  m.metallic_ = within(r.number("metallic", 1.0f), 0.0f, 1.0f);
  m.emission_ = within(r.vec3("emission", Vec3(0.0f)), 0.0f, 0x1.fffffep127f);
  m.base_texture_ = TextureSampler(scene, r.texture("base_color_texture"));
  m.metallic_texture_ = TextureSampler(scene, r.texture("metallic_roughness_texture"));
  m.emission_texture_ = TextureSampler(scene, r.texture("emission_texture"));
  m.alpha_ = Alpha(r, within(base.w, 0.0f, 1.0f), m.base_texture_);
  // Metal does not transmit. Where a texture says what is metal, its factor says nothing of the glass.
  const float share = within(r.number("transmission", 0.0f), 0.0f, 1.0f);
  m.alpha_.let_through(m.metallic_texture_ ? share : share * (1.0f - m.metallic_),
                       TextureSampler(scene, r.texture("transmission_texture")));
  m.double_sided_ = r.number("double_sided", 0.0f) != 0.0f;
  return m;
}

Vec3 Diffuse::albedo(const Attributes& a) const {
  Vec3 color = base_color_ * Vec3(a.color);
  if (base_texture_) color *= base_texture_.color(a.uv);
  const float metallic = metallic_texture_ ? metallic_ * metallic_texture_.color(a.uv).z : metallic_;
  return glm::min(color, Vec3(1.0f)) * (1.0f - metallic);  // above 1 would create energy
}

}  // namespace kiln
