// The pictures of docs/leaks.md: leaks FOLDER. Dark places lit by a lamp a thousand times weaker than what is
// outside, so that something is to be seen; before and after, side by side.
#include <cstdio>

#include "coordinator/report/preview.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/leaks/leak_bake.h"
#include "tests/leaks/leak_scenes.h"

namespace kiln::test {
namespace {

Camera look_at(const Vec3& eye, const Vec3& target, float fov) {
  Camera c;
  const Vec3 z = normalize_or(eye - target, Vec3(0, 0, 1)),
             x = normalize_or(cross(Vec3(0, 1, 0), z), Vec3(1, 0, 0));
  c.to_world = Mat4x3(x, cross(z, x), z, eye);
  c.vertical_fov = fov;
  return c;
}

bool write(const std::filesystem::path& path, LeakScene scene, const Vec3& lamp, const Camera& camera) {
  constexpr uint32_t kWidth = 480, kHeight = 320, kGap = 8, kAll = 2 * kWidth + kGap;
  scene.maker.point(lamp, Vec3(0.05f));
  std::vector<uint8_t> both(size_t{kAll} * kHeight * 3, 255);
  for (const bool cut : {false, true}) {
    AtlasSettings a;
    a.layout = AtlasSettings::Layout::kPack;
    a.cut_contacts = cut;
    const LeakBake b = bake_map(scene.maker.scene(), a, 256);
    ImportResult imported;
    imported.scene = b.scene;
    const Picture p = render_view(imported, b.atlas, b.map, camera, kWidth, kHeight);
    for (uint32_t y = 0; y < kHeight; ++y)
      std::copy_n(&p.rgb[size_t{y} * kWidth * 3], kWidth * 3,
                  &both[(size_t{y} * kAll + (cut ? kWidth + kGap : 0)) * 3]);
  }
  const Status s = write_png(path, kAll, kHeight, both);
  if (!s) std::fprintf(stderr, "%s\n", s.error().message.c_str());
  return s.has_value();
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  using namespace kiln::test;
  if (argc != 2) {
    std::fprintf(stderr, "leaks FOLDER: writes leaks_rooms.png and leaks_table.png\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const bool good = write(folder / "leaks_rooms.png", two_rooms(0.01f), {2, 1.5f, 0.4f},
                          look_at({3.6f, 1.9f, 1.7f}, {0.1f, 0.7f, -0.6f}, 1.0f)) &&
                    write(folder / "leaks_table.png", closed_table(), {0.1f, 0.5f, 0.2f},
                          look_at({1.0f, 0.6f, 0.7f}, {-0.6f, 0.1f, -0.3f}, 1.2f));
  return good ? 0 : 1;
}
