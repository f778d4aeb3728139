// An atlas of a fixed scene.
#include "common/atlas/atlas.h"

#include "common/atlas/site_picker.h"
#include "tests/fuzz/atlas_scene.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_atlas(std::span<const std::byte> data) {
  static const Scene scene = atlas_scene();
  const auto atlas = read_atlas(data, scene);
  require_sentence(atlas);
  if (!atlas) return;
  for (uint32_t i = 0; i < atlas->sites.size(); ++i) {
    const SitePick pick = pick_site(*atlas, i, 0.99f);
    require(pick.instance < scene.instances.size(), "a pick is on an instance of the scene");
    const Mesh& mesh = scene.meshes[scene.instances[pick.instance].mesh];
    require(pick.triangle < mesh.triangles.size(), "a pick is on a triangle of its mesh");
    require(pick.b1 >= 0 && pick.b2 >= 0 && pick.b1 + pick.b2 <= 1 + 1e-6f, "a pick is inside its triangle");
  }
}

}  // namespace kiln::fuzz
