#include <charconv>
#include <optional>

#include "common/base/format.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/camera.h"
#include "coordinator/report/view_score.h"

namespace kiln {
namespace {

constexpr float kUsualFov = 1.0f;  // radians
constexpr double kDegrees = 57.29577951308232;

// Parses "1,2,3:4,5,6:50" as seven numbers, or six without the last.
std::optional<std::vector<double>> numbers_of(const std::string& wish) {
  std::vector<double> out;
  const char *at = wish.data(), *const end = at + wish.size();
  while (true) {
    double v = 0;
    const auto [next, code] = std::from_chars(at, end, v);
    if (code != std::errc() || !std::isfinite(static_cast<float>(v))) return std::nullopt;
    out.push_back(v);
    at = next;
    if (at == end) break;
    const char wanted = out.size() % 3 == 0 ? ':' : ',';
    if (out.size() == 7 || *at++ != wanted) return std::nullopt;
  }
  return out.size() == 6 || out.size() == 7 ? std::optional(out) : std::nullopt;
}

Expected<Camera> camera_of(const std::string& wish, const std::vector<double>& n) {
  const Vec3 eye(DVec3(n[0], n[1], n[2])), target(DVec3(n[3], n[4], n[5]));
  if (eye == target)
    return fail(ErrorKind::kUsage, text("--camera {}: position and target are the same", wish));
  if (n.size() == 7 && !(n[6] >= 1 && n[6] <= 170))
    return fail(ErrorKind::kUsage, text("--camera {}: a view of {} degrees is outside 1 to 170", wish, n[6]));
  return look_along(eye, target - eye, n.size() == 7 ? static_cast<float>(n[6] / kDegrees) : kUsualFov,
                    "asked for");
}

Expected<Camera> wished(const ImportResult& imported, const std::string& wish) {
  std::string names;
  for (const Camera& camera : imported.cameras) {
    if (camera.name == wish) return camera;
    names += text("{}'{}'", names.empty() ? "" : ", ", camera.name);
  }
  if (const auto numbers = numbers_of(wish)) return camera_of(wish, *numbers);
  return fail(
      ErrorKind::kUsage,
      text("--camera {}: {} has no camera of that name; {}. X,Y,Z:X,Y,Z[:FOV] (place, target, vertical "
           "degrees) puts one anywhere",
           wish, imported.document.path.filename().string(),
           names.empty() ? "it has none" : "it has " + names));
}

}  // namespace

Status check_camera(const ImportResult& imported, const std::string& wish) {
  if (wish.empty()) return {};
  KILN_TRY_STATUS(wished(imported, wish));
  return {};
}

Expected<Camera> preview_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                const std::string& wish) {
  if (!wish.empty()) return wished(imported, wish);
  if (!imported.cameras.empty()) {
    const SurfaceLook look(imported.scene, atlas, map);
    const SceneRays rays(imported.scene);
    const Watcher watcher(imported.scene, look, rays, 1.0f);
    for (const Camera& camera : imported.cameras)
      if (shows_something(watcher.view(camera, 32, 18))) return camera;
  }
  return choose_camera(imported, atlas, map);
}

}  // namespace kiln
