// Small scenes made in code, in the prepared form.
#pragma once

#include "common/scene/scene.h"

namespace kiln::test {

class SceneMaker {
 public:
  // A parallelogram with corner `origin` and edges u, v; normal along cross(u, v); lightmap coordinates
  // cover [0,1]^2.
  SceneMaker& quad(const Vec3& origin, const Vec3& u, const Vec3& v, uint32_t material = 0);
  // A sphere of 2 n^2 quads in latitude and longitude, smooth normals outwards (or inwards).
  SceneMaker& sphere(const Vec3& centre, float radius, int n, uint32_t material = 0, bool inwards = false);
  // A box of six quads, normals outwards or inwards.
  SceneMaker& box(const Vec3& low, const Vec3& high, bool inwards, uint32_t material = 0);

  // Lambert: no specular layer at all. Returns its index.
  uint32_t lambert(const Vec3& albedo, const Vec3& emission = Vec3(0.0f), bool double_sided = false);
  uint32_t metallic_roughness(const Vec3& color, float metallic, float roughness);

  SceneMaker& environment(const Vec3& radiance);
  // An equirectangular image from radiance(direction).
  template <class F>
  SceneMaker& environment_image(uint32_t width, uint32_t height, const F& radiance, float scale = 1.0f);
  SceneMaker& sun(const Vec3& to_light, const Vec3& irradiance, float degrees = 0);
  SceneMaker& point(const Vec3& position, const Vec3& intensity, float range = 0);
  SceneMaker& spot(const Vec3& position, const Vec3& towards, const Vec3& intensity, float inner,
                   float outer);

  // Around `centre`, with unit axes x and y at right angles; shines along cross(y, x), or to both sides.
  SceneMaker& rectangle(const Vec3& centre, const Vec3& x, const Vec3& y, const Vec2& size,
                        const Vec3& radiance, int sides = 1);
  SceneMaker& disc(const Vec3& centre, const Vec3& shine, float radius, const Vec3& radiance, int sides = 1);

  Scene take() { return std::move(scene_); }
  Scene& scene() { return scene_; }

 private:
  SceneMaker& add(Mesh mesh, uint32_t material);
  SceneMaker& add_environment(uint32_t width, uint32_t height, const std::vector<float>& texels, float scale);
  Scene scene_;
};

// Unit direction of the centre of texel (x, y) of an equirectangular image.
Vec3 equirect_direction(uint32_t x, uint32_t y, uint32_t width, uint32_t height);

template <class F>
SceneMaker& SceneMaker::environment_image(uint32_t width, uint32_t height, const F& radiance, float scale) {
  std::vector<float> texels;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const Vec3 value = radiance(equirect_direction(x, y, width, height));
      for (int c = 0; c < 3; ++c) texels.push_back(value[c]);
    }
  return add_environment(width, height, texels, scale);
}

}  // namespace kiln::test
