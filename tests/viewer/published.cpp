#include "tests/viewer/published.h"

#include "coordinator/scene/imageio/exr.h"

namespace kiln::test {

Expected<Published> read_published(const std::filesystem::path& scene, const BakeSettings& settings,
                                   const std::filesystem::path& folder) {
  Published p;
  std::vector<StageTime> times;
  KILN_TRY(Preflight pre, run_preflight(scene, settings, times, [](const BakeProgress&) {}));
  p.imported = std::move(pre.imported);
  p.atlas = std::move(pre.atlas);
  KILN_TRY(const Planes e, read_exr(folder / "irradiance.exr"));
  KILN_TRY(const Planes v, read_exr(folder / "validity.exr"));
  p.map.page_height = e.height;
  p.map.planes.width = e.width;
  p.map.planes.height = e.height;
  for (const char* name : {"R", "G", "B"}) p.map.planes.add(std::string("E.") + name) = e.plane(name);
  for (const float c : v.plane("Y")) p.map.validity.push_back(static_cast<Validity>(static_cast<int>(c)));
  return p;
}

}  // namespace kiln::test
