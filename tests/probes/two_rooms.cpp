#include "tests/probes/two_rooms.h"

#include <stdexcept>

#include "common/math/sequence.h"
#include "tests/analytic/scene_maker.h"
#include "tests/probes/in_process_probes.h"

namespace kiln::test {
namespace {

constexpr float kWide = 4, kHigh = 3, kLong = 8;

struct Place {
  Vec3 position, normal;
};

Place place_in_dark_room(float wall, uint32_t i) {
  const SampleStream stream(7, 0, i);
  const Vec2 u = stream.pair(0);
  const float x = kWide + wall;
  switch (i % 3) {
    case 0:
      return {{x, kHigh * u.x, kLong * u.y}, {1, 0, 0}};
    case 1:
      return {{x + kWide * u.x, 0, kLong * u.y}, {0, 1, 0}};
    default:
      return {{x + kWide * u.x, kHigh, kLong * u.y}, {0, -1, 0}};
  }
}

}  // namespace

Scene two_rooms(float wall) {
  SceneMaker m;
  const uint32_t shining = m.lambert(Vec3(0.5f), Vec3(1.0f)), dark = m.lambert(Vec3(0.5f));
  m.box({0, 0, 0}, {kWide, kHigh, kLong}, true, shining);
  m.box({kWide + wall, 0, 0}, {2 * kWide + wall, kHigh, kLong}, true, dark);
  return m.take();
}

Leak leak_of(float wall, double spacing, int offsets, int points, uint32_t samples, const ProbeQuery& query,
             bool keep_inside) {
  const Scene scene = two_rooms(wall);
  std::vector<double> leaks;
  for (int o = 0; o < offsets; ++o) {
    ProbeBox box;
    box.name = "rooms";
    box.spacing = box.max_spacing = spacing;
    box.visibility = true;
    // Lattice points of rank 1, so that all offsets differ along every axis.
    const double t = (o + 0.5) / offsets;
    const DVec3 offset(t, std::fmod(7 * t, 1.0), std::fmod(11 * t, 1.0));
    box.low = (offset - DVec3(1)) * spacing;
    box.high = DVec3(2 * kWide + wall, kHigh, kLong) + DVec3(0.01);
    ProbeLimits limits;
    limits.most = 1'000'000;
    auto layout = lay_out_probes(scene, {box}, limits);
    if (!layout) throw std::runtime_error(layout.error().message);
    if (keep_inside)
      for (size_t i = 0; i < layout->size(); ++i) {
        layout->place[i] = layout->grid[i];
        layout->state[i] = ProbeState::kActive;
      }
    const ProbeField field = bake_layout(scene, *layout, samples, true);
    for (int i = 0; i < points; ++i) {
      const Place p = place_in_dark_room(wall, static_cast<uint32_t>(i));
      const ProbeLight light = query_probes(layout->volumes, field, p.position, p.normal, query);
      leaks.push_back(luminance(light.irradiance) / (2 * M_PI));
    }
  }
  std::sort(leaks.begin(), leaks.end());
  Leak out;
  for (const double l : leaks) out.mean += l / static_cast<double>(leaks.size());
  out.p99 = leaks[leaks.size() * 99 / 100];
  return out;
}

}  // namespace kiln::test
