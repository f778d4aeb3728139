// The mean emission of a material over triangles, integrated in texel space.
#pragma once

#include "worker/surface/surfaces.h"

namespace kiln {

// The bilinear interpolant of the emissive texture is integrated exactly: a triangle is cut along the lines
// between texel centres (texel edges for nearest filtering), and a rule of degree two, the degree of the
// interpolant, sums each piece. Two cases are approximate: triangles that cover more texels than the budget
// use halved images with the same mean, and vertex colours on a texture raise the degree to three or four. A
// triangle without area in texture space is integrated by points.
class EmissionMap {
 public:
  // `triangles`: how many will be queried; they share the texel budget.
  EmissionMap(const EmissionParts& parts, size_t triangles);

  // Mean luminance of the emission over a triangle with corner attributes a[0..2]; never 0 if a
  // texel that the triangle touches emits.
  double mean(const Attributes (&a)[3]) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Vec3> texels;
  };
  static Level load(const TextureSampler& sampler);
  static Level halved(const Level& level);
  // Luminance times the factor.
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
