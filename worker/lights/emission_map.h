// The mean emission of a material over triangles, by integrating its texture in texel space.
#pragma once

#include "worker/surface/surfaces.h"

namespace kiln {

// The bilinear interpolant of the emissive texture is integrated exactly: a triangle is cut along the lines
// between texel centres (the texels' edges where the filter is nearest), and on each piece a rule of degree
// two sums the interpolant, which has that degree. Approximate are: triangles that cover more texels than the
// budget, which are integrated over halved images of the same mean, and vertex colours on top of a texture
// (degree three or four). A triangle whose texture coordinates have no area is integrated by points.
class EmissionMap {
 public:
  // `triangles`: how many will be asked for; they share the budget of texels.
  EmissionMap(const EmissionParts& parts, size_t triangles);

  // Mean luminance of the emission over a triangle with attributes a[0..2] at its corners; never 0 where a
  // texel that the triangle touches shines.
  double mean(const Attributes (&a)[3]) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Vec3> texels;
  };
  static Level load(const TextureSampler& sampler);
  static Level halved(const Level& level);
  // Luminance of the product with the factor.
  double shade(const Vec3& texture, const Vec3& color) const;
  const Vec3& texel(const Level& level, int x, int y) const;
  Vec3 filtered(const Level& level, double x, double y, int cell_x, int cell_y) const;
  double textured(const Attributes (&a)[3], const Vec3 (&color)[3]) const;
  double over_cells(const Level& level, const DVec2 (&p)[3], const Vec3 (&color)[3]) const;
  double over_points(const Level& level, const DVec2 (&p)[3], const Vec3 (&color)[3]) const;

  EmissionParts parts_;
  std::vector<Level> levels_;
  Wrap wrap_s_ = Wrap::kRepeat, wrap_t_ = Wrap::kRepeat;
  bool nearest_ = false;
  double most_cells_ = 0;
};

}  // namespace kiln
