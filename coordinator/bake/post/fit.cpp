#include "common/atlas/texel_normals.h"
#include "common/base/parallel.h"
#include "coordinator/bake/post/stage.h"

namespace kiln {
namespace {

constexpr size_t kFirst = 3;  // planes of the basis follow E's

// E and functions of one colour at a texel.
struct Colour {
  float e;
  float f[kMaxBasisFunctions];
};

Colour load(const Planes& planes, size_t functions, size_t colour, size_t texel) {
  Colour out{planes.data[colour][texel], {}};
  for (size_t k = 0; k < functions; ++k) out.f[k] = planes.data[kFirst + 3 * k + colour][texel];
  return out;
}

void finish(const BasisInfo& basis, const std::vector<Vec3>& normals, Planes& planes) {
  const size_t functions = basis.functions.size();
  for_each_index(normals.size(), 0, [&](size_t texel) {
    if (normals[texel] == Vec3(0.0f)) return;
    for (size_t colour = 0; colour < 3; ++colour) {
      Colour c = load(planes, functions, colour, texel);
      basis.finish(c.e, normals[texel], c.f);
      for (size_t k = 0; k < functions; ++k) planes.data[kFirst + 3 * k + colour][texel] = c.f[k];
    }
  });
}

}  // namespace

Figures fit_basis(Lightmap& map, const PostContext& context) {
  const BasisInfo& basis = basis_of(context.settings);
  if (!map.has_light || !basis.finish) return {};
  const std::vector<Vec3> normals = texel_normals(context.scene, context.atlas);
  finish(basis, normals, map.planes);
  if (!map.measured.data.empty()) finish(basis, normals, map.measured);
  map.bounds = direction_bounds(basis);
  return {};
}

}  // namespace kiln
