// Scenes with one kind of light each, and all of them, ready for sampling.
#pragma once

#include <memory>

#include "tests/analytic/scene_maker.h"
#include "worker/lights/lights.h"

namespace kiln::test {

struct LitScene {
  std::unique_ptr<Surfaces> surfaces;
  Lights lights;
  std::vector<std::string> warnings;
};
LitScene light_up(Scene scene, LightChoice choice = LightChoice::kTree);

// A material that emits the texture; returns its index.
uint32_t emissive_texture(SceneMaker& maker, Texture texture, bool double_sided = false);
// One channel repeated; texels row by row.
Texture gray_texture(uint32_t width, uint32_t height, const std::vector<float>& texels);
// A quad with texture coordinates that cover [0, repeats]^2.
void textured_quad(SceneMaker& maker, const Vec3& origin, const Vec3& u, const Vec3& v, uint32_t material,
                   float repeats = 1);

// An "ies" record at `position` with its table.
void add_ies(Scene& scene, const Vec3& position, const std::vector<double>& vertical,
             const std::vector<double>& horizontal, const std::vector<float>& candela);

// Every local light there is: points with and without range, spots, profiles, one- and two-sided triangles,
// plain and textured, rectangles and discs, `n` of each within the box.
Scene mixed_lights(int n, uint64_t seed, const Vec3& low, const Vec3& high);

}  // namespace kiln::test
