#include "tests/density/squares.h"

namespace kiln::test {

GltfBuilder square_meshes(float side) {
  GltfBuilder b;
  const int positions = b.vec3({0, 0, 0, 0, 0, side, side, 0, side, side, 0, 0});
  const int uv = b.vec2({0, 0, 0, 1, 1, 1, 1, 0});
  const int indices = b.accessor_of(std::vector<uint16_t>{0, 1, 2, 0, 2, 3}, 5123, "SCALAR", 1);
  json primitive = {{"attributes", {{"POSITION", positions}, {"TEXCOORD_1", uv}}}, {"indices", indices}};
  b.mesh(primitive);
  b.material({{"name", "paint"}});
  primitive["material"] = 0;
  b.mesh(primitive);
  return b;
}

json square_at(const std::string& name, double x, double y, double z) {
  return {{"name", name}, {"mesh", 0}, {"translation", {x, y, z}}};
}

json kiln_extras(json kiln) {
  return {{"kiln", std::move(kiln)}};
}

}  // namespace kiln::test
