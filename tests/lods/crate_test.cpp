// The promise: a level that was not baked shows the light that a bake of its own would give it.
#include "tests/lods/crate.h"

namespace kiln {
namespace {
using namespace test;

constexpr float kDensity = 32;  // texels per metre: the bevel is two texels wide
constexpr uint32_t kSamples = 256;

LeakBake baked_level(int level, uint64_t seed, float density = kDensity) {
  const Scene scene = crate_scene(level);
  return bake_map(scene, crate_atlas(scene, density), kSamples, seed);
}

struct Difference {
  size_t points = 0;
  double mean = 0, rms = 0, worst = 0, bias = 0;  // relative to the mean of E over all points
};

// Of two ways to look up the light of the same points, of those that `counts` takes.
struct Pair {
  DVec3 at, normal;
  double projected, direct;
  double moved = 0,
         turned = 0;  // from the point to the place whose light it gets: metres, unit normals' difference
};
Difference difference(
    const std::vector<Pair>& pairs, double mean,
    const std::function<bool(const Pair&)>& counts = [](const Pair&) { return true; }) {
  Difference d;
  for (const Pair& p : pairs) {
    if (!counts(p)) continue;
    const double step = (p.projected - p.direct) / mean;
    d.rms += step * step;
    d.bias += step;
    d.worst = std::max(d.worst, std::abs(step));
    ++d.points;
  }
  d.rms = std::sqrt(d.rms / static_cast<double>(d.points));
  d.bias /= static_cast<double>(d.points);
  return d;
}

// A point of the flat part of a face whose bilinear lookups reach no bevel: two texels (a texel and its
// neighbour) off.
bool is_flat(const Pair& p) {
  constexpr double kInner = 0.5 * kCrateSize - kCrateBevel - 2 / kDensity;
  int across = 0, within = 0;
  for (int axis = 0; axis < 3; ++axis) {
    across += std::abs(p.at[axis]) > 0.5 * kCrateSize - 1e-4;
    within += std::abs(p.at[axis]) < kInner;
  }
  return across == 1 && within == 2;
}

std::vector<Pair> pairs_of(const LeakBake& fine, const LeakBake& own, int level, double split,
                           DisplayFit& fit) {
  const Display display = display_of(crate_level(level), Mat4x3(1.0f));
  LodSettings settings;
  settings.split = split;
  const auto projection = project_display(display, fine.scene, fine.atlas, settings);
  EXPECT_TRUE(projection) << projection.error().message;
  if (!projection) return {};
  fit = projection->fits[0];
  const ProjectedCharts& charts = projection->charts[0];
  const AtlasLookup lookup(own.atlas);
  const SourceSurface source(fine.scene, fine.atlas, {0});
  std::vector<Pair> pairs;
  for (size_t f = 0; f < charts.charts.face_count(); ++f) {
    const FacePart& part = charts.charts.parts[f];
    const DVec3 a = display_point(display, charts, f, 0, 0).at,
                b = display_point(display, charts, f, 1, 0).at,
                c = display_point(display, charts, f, 0, 1).at;
    // Two points a texel everywhere, at places that keep no step with texels (Roberts 2018, R2 sequence).
    const auto count = static_cast<uint32_t>(1 + length(cross(b - a, c - a)) * kDensity * kDensity);
    for (uint32_t i = 0; i < count; ++i) {
      const double serial = static_cast<double>(pairs.size());
      double b1 = 0.7548776662466927 * serial, b2 = 0.5698402909980532 * serial;
      b1 -= std::floor(b1), b2 -= std::floor(b2);
      if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
      const DisplayPoint p = display_point(display, charts, f, b1, b2);
      const DVec2 q = DVec2(part.corner[0]) + b1 * DVec2(part.corner[1] - part.corner[0]) +
                      b2 * DVec2(part.corner[2] - part.corner[0]);
      const LitPoint s =
          place_in_chart(source, p, {fit.limit}, charts.placement[charts.charts.chart_of_face[f]]);
      const AtlasPlace place = projected_place(fine.atlas, charts, f, b1, b2);
      const double shift = length(place.texels - s.texels) / kDensity;
      pairs.push_back({p.at, p.normal, fine.bilinear(place),
                       own.bilinear(lookup.at(0, part.triangle, q.x, q.y)), s.distance + shift,
                       length(s.normal - p.normal)});
    }
  }
  return pairs;
}

// What the geometry accounts for. Light F from one direction l gives E = F max(n.l, 0): a turn by d changes
// it by F d at most, and F is no more than the range of E over a crate's bevels, which look all ways. Along a
// face E changes by no more than that range in half its length. A lookup near a bevel mixes normals that one
// texel turns by 1 texel / radius, in both bakes.
double geometry_bound(const Pair& p, double range) {
  const double texel_turn = is_flat(p) ? 0 : 2 / (kCrateBevel * kDensity);
  return range * (p.turned + texel_turn) + 2 * range / kCrateSize * (p.moved + 0.5 / kDensity);
}

TEST(Lods, LevelsOfACrateGetTheLightOfABakeOfTheirOwn) {
  const LeakBake fine = baked_level(0, 0);
  printf(
      "| level | triangles | drawn as | farthest | lookups miss by | points | rms, flat parts | worst | rms, "
      "everywhere | worst | bias |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  struct Row {
    const char* name;
    int level;
    float density;
    double split;
  };
  double noise_rms = 0, noise_worst = 0;
  // First level 0 against itself with other random numbers and another grid: what bakes differ by anyway.
  for (const Row& row : {Row{"0, baked twice", 0, 0.97f * kDensity, 1},
                         {"1", 1, kDensity, 1},
                         {"2", 2, kDensity, 1},
                         {"2, `--lod-split 0.25`", 2, kDensity, 0.25}}) {
    const LeakBake own = baked_level(row.level, 1, row.density);
    DisplayFit fit;
    const std::vector<Pair> pairs = pairs_of(fine, own, row.level, row.split, fit);
    double mean = 0, low = 1e30, high = 0;
    for (const Pair& p : pairs) {
      mean += p.direct / static_cast<double>(pairs.size());
      low = std::min({low, p.direct, p.projected}), high = std::max({high, p.direct, p.projected});
    }
    const Difference all = difference(pairs, mean), flat = difference(pairs, mean, is_flat);
    printf(
        "| %s | %zu | %zu | %.1f mm | %.2f texels | %zu | %.2f %% | %.2f %% | %.2f %% | %.2f %% | %+.2f %% "
        "|\n",
        row.name, size_t(fit.triangles), size_t(fit.faces), 1000 * fit.worst, fit.shift_texels, all.points,
        100 * flat.rms, 100 * flat.worst, 100 * all.rms, 100 * all.worst, 100 * all.bias);
    ASSERT_GT(flat.points, 1000u);
    if (row.level == 0) {
      noise_rms = std::max(flat.rms, all.rms);
      noise_worst = std::max(flat.worst, all.worst);
      continue;
    }
    // The rms of some 1000 independent texels scatters by 1 / sqrt(2 x 1000) = 2.2 %: five of these.
    double flat_bound = 0, all_bound = 0;
    size_t beyond = 0;
    for (const Pair& p : pairs) {
      const double bound = geometry_bound(p, high - low) / mean;
      beyond += std::abs(p.projected - p.direct) / mean > bound + noise_worst;
      all_bound += bound * bound / static_cast<double>(pairs.size());
      if (is_flat(p)) flat_bound += bound * bound / static_cast<double>(flat.points);
    }
    const double noise = 1.11 * 1.11 * noise_rms * noise_rms;
    EXPECT_LT(flat.rms, std::sqrt(noise + flat_bound)) << row.name;
    EXPECT_LT(all.rms, std::sqrt(noise + all_bound)) << row.name;
    EXPECT_EQ(beyond, 0u) << row.name;
    EXPECT_LT(fit.worst, fit.limit);
  }
}

}  // namespace
}  // namespace kiln
