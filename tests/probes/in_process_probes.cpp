#include "tests/probes/in_process_probes.h"

#include <stdexcept>

#include "common/base/check.h"
#include "common/base/parallel.h"

namespace kiln::test {
namespace {

TransportSettings probe_settings(bool visibility, uint64_t seed) {
  TransportSettings s;
  s.basis = *find_basis("sh_l2");
  s.quantities.probes = true;
  s.quantities.probe_visibility = visibility;
  s.seed = seed;
  return s;
}

ProbeField field_at(const std::vector<Vec3>& places, bool visibility) {
  ProbeField f;
  f.place = places;
  f.state.assign(places.size(), ProbeState::kActive);
  f.validity.assign(places.size(), 1);
  f.light.resize(places.size());
  f.error.resize(places.size());
  f.irradiance_error.resize(places.size());
  f.samples.resize(places.size());
  if (visibility) {
    f.irradiance.resize(places.size() * kIrradianceTexels);
    f.distance.resize(places.size() * kDistanceTexels);
  }
  return f;
}

// Bakes points and writes point i to probe probes[i].
void bake_points(Scene scene, ProbePoints points, const std::vector<uint32_t>& probes, uint32_t samples,
                 const TransportSettings& settings, BakedField& out) {
  const size_t count = points.points.size();
  const auto baker = Baker::create_for_probes(std::move(scene), std::move(points), settings, 2);
  if (!baker) throw std::runtime_error(baker.error().message);
  Accumulator sums(count, MomentLayout(settings.basis, settings.quantities));
  constexpr size_t kRun = 16;
  std::vector<WorkUnit> units;
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (size_t first = 0; first < count; first += kRun) {
      WorkUnit unit{units.size(), 0, samples, {}, r};
      for (size_t i = first; i < std::min(count, first + kRun); ++i)
        unit.sites.push_back(static_cast<uint32_t>(i));
      units.push_back(unit);
    }
  std::vector<UnitResult> results(units.size());
  parallel_for(units.size(), [&](size_t i) { results[i] = *(*baker)->bake(units[i]); });
  for (size_t i = 0; i < units.size(); ++i) {
    KILN_CHECK(results[i].nonfinite == 0);
    KILN_CHECK(sums.add(units[i], results[i]).has_value());
  }
  resolve_probes(sums, probe_errors(sums, std::vector<uint32_t>(count, 0)), probes, out.field);
  out.difference.resize(out.field.size());
  for (uint32_t i = 0; i < count; ++i)
    for (size_t k = 0; k < kHarmonics; ++k) {
      double of[2];
      for (uint32_t r = 0; r < 2; ++r) {
        const size_t plane = kMomentBasis + 3 * kFromMoments[k].function;
        of[r] =
            luminance(DVec3(sums.sum(i, plane, r), sums.sum(i, plane + 1, r), sums.sum(i, plane + 2, r))) /
            sums.samples(i, r);
      }
      out.difference[probes[i]][k] = static_cast<float>(kFromMoments[k].scale * std::abs(of[0] - of[1]) / 2);
    }
}

}  // namespace

BakedField bake_probes_at(Scene scene, const std::vector<Vec3>& places, uint32_t samples, bool visibility,
                          float reach, uint64_t seed) {
  BakedField out{field_at(places, visibility), {}};
  ProbePoints points;
  std::vector<uint32_t> probes;
  for (const Vec3& p : places) {
    probes.push_back(static_cast<uint32_t>(probes.size()));
    points.points.push_back({p, reach});
  }
  bake_points(std::move(scene), std::move(points), probes, samples, probe_settings(visibility, seed), out);
  return out;
}

ProbeField bake_layout(const Scene& scene, const ProbeLayout& layout, uint32_t samples, bool visibility) {
  BakedField out{field_at(layout.place, visibility), {}};
  out.field.state = layout.state;
  ProbePoints points;
  std::vector<uint32_t> probes;
  for (uint32_t p = 0; p < layout.size(); ++p)
    if (layout.state[p] != ProbeState::kInactive) {
      probes.push_back(p);
      points.points.push_back({layout.place[p], layout.reach[p]});
    }
  bake_points(scene, std::move(points), probes, samples, probe_settings(visibility, 0), out);
  return std::move(out.field);
}

}  // namespace kiln::test
