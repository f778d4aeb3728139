// What choosing a camera and drawing the report's pictures cost: pictures SCENE... [-o FOLDER]. Seconds of
// all threads, of an unbaked map; with a folder each scene's view as NAME.png.
#include <sys/resource.h>

#include <cstdio>
#include <filesystem>

#include "coordinator/report/camera.h"
#include "coordinator/report/density_view.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

bool measure(const std::filesystem::path& scene, const std::filesystem::path& folder) {
  BakeSettings settings;
  settings.layout = "pack";
  settings.texels_per_metre = 1;
  settings.max_texels = 300000;
  settings.contact_cuts = false;
  std::vector<StageTime> times;
  const auto pre = run_preflight(scene, settings, times, [](const BakeProgress&) {});
  if (!pre) {
    std::fprintf(stderr, "%s\n", pre.error().message.c_str());
    return false;
  }
  const Lightmap map = unbaked_lightmap(pre->atlas);
  const double start = cpu_seconds();
  const Camera camera = choose_camera(pre->imported, pre->atlas, map);
  const double chosen = cpu_seconds();
  const auto pictures = make_pictures(pre->imported, pre->atlas, map, camera, {});
  const double drawn = cpu_seconds();
  const auto cost = measure_pictures(pre->imported, pre->atlas, map, camera);
  if (!pictures || !cost) return false;
  std::printf("%-26s %9zu triangles  camera %5.2f s  pictures %5.2f s  foretold (wall) %5.2f s\n",
              scene.filename().c_str(), pre->imported.scene.triangle_count(), chosen - start, drawn - chosen,
              cost->seconds({}));
  if (folder.empty()) return true;
  const Picture view = density_view(pre->imported, pre->atlas, camera, 640, 360);
  return static_cast<bool>(
      write_png(folder / scene.filename().replace_extension(".png"), view.width, view.height, view.rgb));
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  std::filesystem::path folder;
  bool good = argc > 1;
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]) == "-o" && i + 1 < argc) folder = argv[++i];
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "-o") {
      ++i;
      continue;
    }
    good &= kiln::measure(argv[i], folder);
  }
  if (argc < 2) std::fprintf(stderr, "pictures SCENE... [-o FOLDER]\n");
  return good ? 0 : 1;
}
