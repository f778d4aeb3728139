#include "coordinator/report/validity_view.h"

#include "common/base/format.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/picture/label.h"
#include "coordinator/report/report.h"

namespace kiln {
namespace {

constexpr Validity kClasses[] = {Validity::kMeasured, Validity::kPushed, Validity::kFilled,
                                 Validity::kDilated,  Validity::kInside, Validity::kEmpty};

// Cosine between the surface normal and the direction to the eye, absolute.
float facing(const Scene& scene, const Fragment& f, const Vec3& eye) {
  const Instance& in = scene.instances[f.instance];
  const Mesh& mesh = scene.meshes[in.mesh];
  const UVec3& t = mesh.triangles[f.triangle];
  const Vec3 a = transform_point(in.to_world, mesh.positions[t.x]);
  const Vec3 ab = transform_point(in.to_world, mesh.positions[t.y]) - a;
  const Vec3 ac = transform_point(in.to_world, mesh.positions[t.z]) - a;
  const Vec3 point = a + ab * f.b1 + ac * f.b2;
  return std::abs(dot(normalize_or(cross(ab, ac), Vec3(0, 1, 0)), normalize_or(eye - point, Vec3(0, 1, 0))));
}

Picture colored_classes(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                        const Camera& camera, const View& view, uint32_t fine) {
  const SurfaceLook look(imported.scene, atlas, map);
  return supersampled(view.width / fine, view.height / fine, fine, [&](size_t i) {
    const Fragment& f = view.fragments[i];
    if (f.inverse_depth == 0) return Vec3(40.0f);
    const Validity v = look.receives(f) ? map.validity[look.texel(f)] : Validity::kEmpty;
    const auto rgb = class_color(v);
    const Vec3 color(rgb[0], rgb[1], rgb[2]);
    if (v == Validity::kInside) return color;
    return color * (0.4f + 0.6f * facing(imported.scene, f, camera.to_world[3]));
  });
}

Picture legend(const Lightmap& map, uint32_t width) {
  constexpr uint32_t kScale = 2, kSwatch = 14, kStep = 10;
  uint64_t count[kValidityClasses] = {};
  for (const Validity v : map.validity) ++count[static_cast<int>(v)];
  Picture p(width, 34, 40);
  uint32_t x = kStep;
  for (const Validity v : kClasses) {
    for (uint32_t dy = 0; dy < kSwatch; ++dy)
      for (uint32_t dx = 0; dx < kSwatch && x + dx < width; ++dx) p.set(x + dx, kStep + dy, class_color(v));
    x += kSwatch + kStep / 2;
    const std::string words = text("{} {}", validity_name(v), count[static_cast<int>(v)]);
    draw_label(p, x, kStep, kScale, words, {230, 230, 230});
    x += label_width(kScale, words) + 2 * kStep;
  }
  return p;
}

}  // namespace

std::array<uint8_t, 3> class_color(Validity v) {
  switch (v) {
    case Validity::kEmpty:
      return {0, 0, 0};
    case Validity::kMeasured:
      return {190, 190, 190};
    case Validity::kPushed:
      return {255, 140, 0};
    case Validity::kFilled:
      return {255, 225, 40};
    case Validity::kDilated:
      return {50, 110, 255};
    case Validity::kInside:
      return {255, 0, 255};
  }
  return {};
}

Picture validity_scene(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                       const Camera& camera, uint32_t width, uint32_t height) {
  const SurfaceLook look(imported.scene, atlas, map);
  const View view = rasterise(imported.scene, camera, width * kSupersample, height * kSupersample,
                              [&](const Fragment& f) { return look.visible(f); });
  return colored_classes(imported, atlas, map, camera, view, kSupersample);
}

Picture validity_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                         const Camera& camera, const View& view, uint32_t fine) {
  constexpr uint32_t kGap = 8;
  const Picture scene = colored_classes(imported, atlas, map, camera, view, fine);
  const Picture sheet = page_sheet(map, scene.height, [&](size_t t) { return class_color(map.validity[t]); });
  const uint32_t width = scene.width + kGap + sheet.width;
  const Picture words = legend(map, width);
  Picture all(width, scene.height + words.height, 40);
  all.paste(scene, 0, 0);
  all.paste(sheet, scene.width + kGap, 0);
  all.paste(words, 0, scene.height);
  return all;
}

}  // namespace kiln
