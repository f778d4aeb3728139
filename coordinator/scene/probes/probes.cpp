#include "coordinator/scene/probes/probes.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/scene/probes/bricks.h"
#include "coordinator/scene/probes/places.h"

namespace kiln {
namespace {

constexpr double kStep = 1.189207115002721;  // 2^(1/4), of the spacing that is solved for
constexpr int kMostSteps = 80;

struct Geometry {
  std::vector<SolidTriangle> triangles;
  DVec3 low{0.0}, high{0.0};
  explicit Geometry(const Scene& scene) : triangles(world_triangles(scene)) {
    bool first = true;
    for (const SolidTriangle& t : triangles)
      for (const DVec3& c : t.corner) {
        low = first ? c : glm::min(low, c);
        high = first ? c : glm::max(high, c);
        first = false;
      }
  }
};

// A volume that nothing is near shows what is around the scene and nothing of it.
Status check_is_near(const ProbeBox& box, const Geometry& g) {
  for (int k = 0; k < 3; ++k)
    if (box.low[k] - box.max_spacing > g.high[k] || box.high[k] + box.max_spacing < g.low[k])
      return fail(
          ErrorKind::kInvalidInput,
          text("probe volume '{}' is off the scene, which goes from {:g} to {:g} along {}: the box from "
               "{:g} to {:g} is beside it",
               box.name, g.low[k], g.high[k], "xyz"[k], box.low[k], box.high[k]));
  return {};
}

Expected<std::vector<PlacedVolume>> place_all(const std::vector<ProbeBox>& boxes, const Geometry& g,
                                              uint64_t most, bool centred) {
  std::vector<PlacedVolume> out;
  uint64_t used = 0;
  for (const ProbeBox& box : boxes) {
    KILN_TRY(PlacedVolume v,
             place_bricks(box, g.triangles, static_cast<uint32_t>(used), most - used, centred));
    used += v.points.size();
    out.push_back(std::move(v));
  }
  return out;
}

void add_volume(const SceneRays& rays, const Solid& solid, PlacedVolume v, ProbeLayout& out) {
  const size_t first = out.size(), count = v.points.size();
  std::vector<ProbePlace> places(count);
  const ProbeVolume& volume = v.volume;
  const auto grid = [&](size_t i) { return Vec3(volume.place(v.points[i])); };
  const auto spacing = [&](uint32_t level) {
    return static_cast<float>(volume.spacing * static_cast<double>(1u << level));
  };
  parallel_for((count + 63) / 64, [&](size_t run) {
    for (size_t i = 64 * run; i < std::min(count, 64 * (run + 1)); ++i)
      places[i] = place_probe(rays, solid, grid(i), spacing(v.finest[i]));
  });
  for (size_t i = 0; i < count; ++i) {
    const ProbePlace& p = places[i];
    out.grid.push_back(grid(i));
    out.place.push_back(p.position);
    out.state.push_back(p.state);
    out.validity.push_back(p.validity);
    // Diagonals of cells of the next coarser level, which queries read too; half more for moved probes.
    const uint32_t level = std::min<uint32_t>(v.coarsest[i] + 1u, volume.levels - 1);
    out.reach.push_back(1.5f * std::sqrt(3.0f) * spacing(level));
    out.exit.push_back(p.exit.value_or(Vec3(0.0f)));
    out.has_exit.push_back(p.exit.has_value());
  }
  out.volumes.push_back(std::move(v.volume));
  KILN_CHECK(out.size() == first + count);
}

}  // namespace

size_t ProbeLayout::active() const {
  return static_cast<size_t>(
      std::count_if(state.begin(), state.end(), [](ProbeState s) { return s != ProbeState::kInactive; }));
}

ProbeBox box_around(const Scene& scene, double spacing, double max_spacing) {
  const Geometry g(scene);
  ProbeBox box;
  box.name = "auto";
  box.spacing = spacing;
  box.max_spacing = max_spacing;
  // Half a spacing inside of outer walls, so that the outermost probes are in the room.
  for (int k = 0; k < 3; ++k) {
    const double inset = std::min(0.5 * spacing, 0.25 * (g.high[k] - g.low[k]));
    box.low[k] = g.low[k] + inset;
    box.high[k] = std::max(g.high[k] - inset, box.low[k] + 1e-3 * spacing);
  }
  return box;
}

Expected<ProbeLayout> lay_out_probes(const Scene& scene, std::vector<ProbeBox> boxes,
                                     const ProbeLimits& limits) {
  const Geometry geometry(scene);
  for (ProbeBox& box : boxes) {
    KILN_TRY_STATUS(check_is_near(box, geometry));
    box.visibility |= limits.visibility;
  }
  ProbeLayout out;
  auto placed = place_all(boxes, geometry, limits.most, limits.may_coarsen);
  double factor = 1;
  for (int step = 0; !placed && limits.may_coarsen && step < kMostSteps; ++step) {
    factor *= kStep;
    std::vector<ProbeBox> coarser = boxes;
    for (ProbeBox& box : coarser) box.spacing *= factor, box.max_spacing *= factor;
    placed = place_all(coarser, geometry, limits.most, limits.may_coarsen);
  }
  if (!placed) return tl::unexpected<Error>(placed.error());
  if (factor > 1)
    out.notes.push_back(
        text("probes are {:g} m apart, not {:g} m, so that there are at most {} of them "
             "(--max-probes)",
             boxes.front().spacing * factor, boxes.front().spacing, limits.most));
  uint64_t count = 0;
  for (const PlacedVolume& v : *placed) count += v.points.size();
  if (limits.accept) KILN_TRY_STATUS(limits.accept(count));
  const SceneRays rays(scene);
  const Solid solid(scene);
  for (PlacedVolume& v : *placed) {
    const size_t first = out.size();
    add_volume(rays, solid, std::move(v), out);
    const auto begin = out.state.begin() + static_cast<ptrdiff_t>(first);
    if (std::all_of(begin, out.state.end(), [](ProbeState s) { return s == ProbeState::kInactive; }))
      return fail(ErrorKind::kInvalidInput,
                  text("probe volume '{}': all of its {} probes are inside geometry: move the box, give it a "
                       "smaller spacing, or check that the surfaces around face the rooms",
                       out.volumes.back().name, out.size() - first));
  }
  return out;
}

}  // namespace kiln
