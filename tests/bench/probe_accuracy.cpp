// Prints tables of docs/probes.md: probe_accuracy SCENE.glb [points] [environment R,G,B] [finest spacing]
// [sun X,Y,Z:R,G,B]. E from probes against path tracing at points that a character can reach, and the
// coverage of stated errors.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>

#include "common/base/parallel.h"
#include "common/base/statistics.h"
#include "common/probes/query.h"
#include "coordinator/scene/import/import.h"
#include "coordinator/scene/sight/scene_rays.h"
#include "coordinator/scene/sight/solid.h"
#include "tests/probes/in_process_probes.h"
#include "worker/bake/path_baker.h"

namespace kiln {
namespace {

constexpr double kSpacings[] = {2, 1, 0.5};                  // metres
constexpr uint32_t kTruthSamples = 64, kProbeSamples = 256;  // of each replicate

// Receivers with a normal of their own, six to a point.
class FacingPoints {
 public:
  explicit FacingPoints(std::vector<Vec3> points) : points_(std::move(points)) {}
  size_t size() const { return 6 * points_.size(); }
  uint32_t key(uint32_t index) const { return index; }
  using Sums = Film;
  static Vec3 normal(uint32_t index) {
    Vec3 n(0.0f);
    n[static_cast<int>(index % 3)] = index % 6 < 3 ? 1.0f : -1.0f;
    return n;
  }
  class Open {
   public:
    Open(const FacingPoints& r, const Surfaces&, const Tracer&, uint32_t index)
        : point_(r.points_[index / 6]), normal_(normal(index)) {}
    SurfacePoint at(const SampleStream&) const {
      SurfacePoint p{};
      p.position = point_;
      p.ng = p.ns = normal_;
      return p;
    }
    std::optional<SitePlaces::Place> instead_of(const SampleStream&, uint64_t&) const { return std::nullopt; }

   private:
    Vec3 point_, normal_;
  };
  std::optional<KnownIrradiance> known(const Scene&, const IrradianceCache&) const { return std::nullopt; }
  void move(const Vec3& offset) {
    for (Vec3& p : points_) p += offset;
  }

 private:
  std::vector<Vec3> points_;
};

// Points 0.1 to 2 m above surfaces that face up, with nothing between, inside of every volume.
std::vector<Vec3> reachable_points(const Scene& scene, size_t count) {
  const SceneRays rays(scene);
  const Solid solid(scene);
  const ProbeBox box = box_around(scene, kSpacings[0], kSpacings[0]);
  struct Floor {
    Vec3 corner[3];
  };
  std::vector<Floor> floors;
  std::vector<double> areas;
  for (const Instance& i : scene.instances)
    for (const UVec3& t : scene.meshes[i.mesh].triangles) {
      Floor f;
      for (int k = 0; k < 3; ++k)
        f.corner[k] = transform_point(i.to_world, scene.meshes[i.mesh].positions[t[k]]);
      const Vec3 across = cross(f.corner[1] - f.corner[0], f.corner[2] - f.corner[0]);
      if (across.y * (determinant(i.to_world) < 0 ? -1 : 1) < 0.7f * length(across)) continue;
      floors.push_back(f);
      areas.push_back((areas.empty() ? 0 : areas.back()) + length(across));
    }
  std::vector<Vec3> points;
  const auto stops = [&](const RayHit& hit) { return solid.stops(hit); };
  for (uint32_t i = 0; points.size() < count && i < 100 * count; ++i) {
    const SampleStream stream(11, 0, i);
    const auto at = std::upper_bound(areas.begin(), areas.end(), stream.pair(0).x * areas.back());
    const Floor& f = floors[static_cast<size_t>(std::min(at, areas.end() - 1) - areas.begin())];
    const Vec2 b = uniform_triangle(stream.pair(1));
    const Vec3 ground = f.corner[0] + (f.corner[1] - f.corner[0]) * b.x + (f.corner[2] - f.corner[0]) * b.y;
    const Vec3 point = ground + Vec3(0, 0.1f + 1.9f * stream.pair(2).x, 0);
    RayHit hit;
    // From above, so that the surface itself does not count; and only points under or above fronts.
    if (rays.closest(point, Vec3(0, -1, 0), (point.y - ground.y) * 0.999f, hit, stops)) continue;
    if (!rays.closest(point, Vec3(0, -1, 0), 3, hit, stops) || !solid.shows(hit)) continue;
    bool inside = false;
    for (const Vec3& d : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)})
      inside |= rays.closest(point, d, 1e9f, hit, stops) && !solid.shows(hit);
    for (int k = 0; k < 3; ++k) inside |= point[k] < box.low[k] || point[k] > box.high[k];
    if (!inside) points.push_back(point);
  }
  return points;
}

// Those of `points` that can be walked to from most others, by steps of kStep along free sight: not the
// hollows of walls, which double-sided surfaces do not give away. At most `count`.
std::vector<Vec3> connected_points(const Scene& scene, const std::vector<Vec3>& points, size_t count) {
  constexpr float kStep = 2.0f;
  const SceneRays rays(scene);
  std::vector<size_t> root(points.size());
  std::iota(root.begin(), root.end(), size_t{0});
  const auto find = [&](size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  std::map<std::array<int, 3>, std::vector<size_t>> cells;
  const auto cell_of = [&](const Vec3& p) {
    return std::array<int, 3>{static_cast<int>(std::floor(p.x / kStep)),
                              static_cast<int>(std::floor(p.y / kStep)),
                              static_cast<int>(std::floor(p.z / kStep))};
  };
  for (size_t i = 0; i < points.size(); ++i) cells[cell_of(points[i])].push_back(i);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto c = cell_of(points[i]);
    for (int n = 0; n < 27; ++n) {
      const auto there = cells.find({c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1});
      if (there == cells.end()) continue;
      for (const size_t j : there->second) {
        const Vec3 way = points[j] - points[i];
        if (j <= i || length(way) > kStep || find(i) == find(j) || rays.is_blocked(points[i], way, 1))
          continue;
        root[find(i)] = find(j);
      }
    }
  }
  std::vector<size_t> sizes(points.size(), 0);
  for (size_t i = 0; i < points.size(); ++i) ++sizes[find(i)];
  const auto largest = static_cast<size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  std::vector<Vec3> out;
  for (size_t i = 0; i < points.size() && out.size() < count; ++i)
    if (find(i) == largest) out.push_back(points[i]);
  std::printf("%zu of %zu points are connected\n", sizes[largest], points.size());
  return out;
}

struct Truth {
  std::vector<double> of[2];  // luminance of E by receiver, of each replicate
  double mean = 0;
};
Truth trace_truth(const Scene& scene, const std::vector<Vec3>& points) {
  TransportSettings settings;
  settings.basis = 0;
  PathBaker<FacingPoints> baker(FacingPoints(points), settings);
  if (const Status built = baker.build(scene, 0); !built) std::abort();
  Truth truth;
  for (uint32_t r = 0; r < 2; ++r) {
    truth.of[r].resize(6 * points.size());
    parallel_for(points.size() / 64 + 1, [&](size_t run) {
      WorkUnit unit{run, 0, kTruthSamples, {}, r};
      for (size_t i = 6 * 64 * run; i < std::min(6 * points.size(), 6 * 64 * (run + 1)); ++i)
        unit.sites.push_back(static_cast<uint32_t>(i));
      if (unit.sites.empty()) return;
      const auto result = baker.bake(unit, nullptr);
      for (size_t i = 0; i < unit.sites.size(); ++i)
        truth.of[r][unit.sites[i]] = result->moments[i * result->plane_count + kMomentLum] / kTruthSamples;
    });
    for (const double e : truth.of[r]) truth.mean += e / static_cast<double>(2 * truth.of[r].size());
  }
  return truth;
}

// Inside of hollow walls and furniture, which no character can reach, there is as good as no light.
bool is_sealed(const Truth& truth, size_t point) {
  double sum = 0;
  for (size_t k = 6 * point; k < 6 * point + 6; ++k) sum += truth.of[0][k] + truth.of[1][k];
  return sum < 0.01 * 12 * truth.mean;
}

// sqrt(mean (q - A)(q - B)) / mean E, over points inside of volumes: the noise of the truth has no part in
// it.
double relative_rmse(const ProbeLayout& layout, const ProbeField& field, const std::vector<Vec3>& points,
                     const Truth& truth, const ProbeQuery& query) {
  const size_t all = 6 * points.size();
  std::vector<double> products(all), light(all), inside(all);
  for_each_index(all, 0, [&](size_t i) {
    const ProbeLight found = query_probes(layout.volumes, field, points[i / 6],
                                          FacingPoints::normal(static_cast<uint32_t>(i)), query);
    if (found.weight < 1 || is_sealed(truth, i / 6)) return;
    const double q = luminance(found.irradiance);
    products[i] = (q - truth.of[0][i]) * (q - truth.of[1][i]);
    light[i] = 0.5 * (truth.of[0][i] + truth.of[1][i]);
    inside[i] = 1;
  });
  double sum = 0, mean = 0, count = 0;
  for (size_t i = 0; i < all; ++i) sum += products[i], mean += light[i], count += inside[i];
  return std::sqrt(std::max(0.0, sum / count)) / (mean / count);
}

void print_coverage(const Scene& scene, const std::vector<Vec3>& points) {
  constexpr uint32_t kMany = 8192;
  const std::vector<Vec3> some(points.begin(),
                               points.begin() + std::min<ptrdiff_t>(400, points.end() - points.begin()));
  const auto reference = test::bake_probes_at(scene, some, kMany, false, 100, 99);
  std::printf("\n| samples | degree 0 | degree 1 | degree 2 | all |\n|---|---|---|---|---|\n");
  for (const uint32_t samples : {16u, 64u, 256u}) {
    const auto baked = test::bake_probes_at(scene, some, samples, false);
    double within[3] = {}, count[3] = {};
    for (size_t i = 0; i < some.size(); ++i)
      for (size_t k = 0; k < kHarmonics; ++k) {
        const double difference = luminance(baked.field.light[i][k] - reference.field.light[i][k]);
        const double error = std::hypot(baked.field.error[i][k], reference.field.error[i][k]);
        within[kHarmonicDegree[k]] += std::abs(difference) <= 1.96 * error;
        count[kHarmonicDegree[k]] += 1;
      }
    std::printf("| %u |", 2 * samples);
    for (int l = 0; l < 3; ++l) std::printf(" %.1f %% |", 100 * within[l] / count[l]);
    std::printf(" %.1f %% |\n", 100 * (within[0] + within[1] + within[2]) / (count[0] + count[1] + count[2]));
  }
}

int run(const char* path, size_t count, const char* environment, double finest, const char* sun) {
  BakeSettings settings;
  if (sun && !set_option(settings, "sun", sun, "the command line"))
    return std::fprintf(stderr, "a sun is X,Y,Z:R,G,B\n"), 2;
  if (environment && *environment) settings.environment = environment;
  auto imported = import_scene(path, settings);
  if (!imported) return std::fprintf(stderr, "%s\n", imported.error().message.c_str()), 1;
  const Scene& scene = imported->scene;
  const std::vector<Vec3> points = connected_points(scene, reachable_points(scene, 4 * count), count);
  const Truth truth = trace_truth(scene, points);
  size_t sealed = 0;
  for (size_t i = 0; i < points.size(); ++i) sealed += is_sealed(truth, i);
  std::printf("%zu points, %zu of them sealed, mean E %.4g\n\n", points.size(), sealed, truth.mean);
  std::printf(
      "| spacing | probes | inactive | L2 kB | L2 | L2, visibility | all kB | octahedral, visibility |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const double spacing : kSpacings) {
    if (spacing < finest) continue;
    ProbeLimits limits;
    limits.most = 60000;
    limits.visibility = true;
    limits.may_coarsen = true;
    const auto layout = lay_out_probes(scene, {box_around(scene, spacing, 4 * spacing)}, limits);
    if (!layout) {
      std::printf("| %g m | %s |\n", spacing, layout.error().message.c_str());
      continue;
    }
    const ProbeField field = test::bake_layout(scene, *layout, kProbeSamples, true);
    const auto rmse = [&](bool visibility, bool octahedral) {
      return 100 * relative_rmse(*layout, field, points, truth, {0.1f, visibility, octahedral});
    };
    const double probes = static_cast<double>(layout->size()), l2 = probes * 54 / 1024,
                 all = probes * (10 * 10 * 4 + 18 * 18 * 4) / 1024;
    std::printf("| %g to %g m | %zu | %zu | %.0f | %.1f %% | %.1f %% | %.0f | %.1f %% |\n", spacing,
                4 * spacing, layout->size(), layout->size() - layout->active(), l2, rmse(false, false),
                rmse(true, false), all, rmse(true, true));
    std::fflush(stdout);
  }
  if (finest == 0) print_coverage(scene, points);
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  if (argc < 2)
    return std::fprintf(stderr, "probe_accuracy SCENE.glb [points] [R,G,B] [finest spacing] [sun]\n"), 2;
  return kiln::run(argv[1], argc > 2 ? static_cast<size_t>(std::atoi(argv[2])) : 10000,
                   argc > 3 ? argv[3] : nullptr, argc > 4 ? std::atof(argv[4]) : 0,
                   argc > 5 ? argv[5] : nullptr);
}
