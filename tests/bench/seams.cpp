// Tables and pictures of docs/seams.md:
//   seams table DENSITY      weights of the solve compared on the room of tests/seams
//   seams pictures FOLDER    the room before and after, side by side, as PNG
//   seams time COUNT...      COUNT x COUNT panels with noise: edges, equations, seconds
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "coordinator/bake/post/stage.h"
#include "coordinator/bake/seams/join.h"
#include "coordinator/report/preview.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/seams/baked_room.h"
#include "tests/seams/pieces.h"
#include "tests/seams/plain_seams.h"

namespace kiln::test {
namespace {

double value(const Lightmap& map, size_t t) {
  return luminance(DVec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t]));
}

// Of texels of instances [first, last] that differ between `before` and `joined`: error of `map` against the
// truth, and how unevenly neighbours changed from `before`, which is what shows as a line along the seam.
// Root mean squares relative to the mean of the truth.
struct Quality {
  double error = 0, unevenness = 0;
};

Quality quality(const Atlas& atlas, uint32_t first, uint32_t last, const Lightmap& before,
                const Lightmap& joined, const Lightmap& map, const Lightmap& truth) {
  Quality q;
  double count = 0, pairs = 0, mean = 0;
  const uint32_t from = atlas.instance_first_chart[first], to = atlas.instance_first_chart[last + 1];
  for (size_t t = 0; t < atlas.owner.size(); ++t) {
    if (atlas.owner[t] <= from || atlas.owner[t] > to || before.validity[t] != Validity::kMeasured) continue;
    if (value(joined, t) == value(before, t)) continue;
    mean += value(truth, t);
    q.error += std::pow(value(map, t) - value(truth, t), 2);
    ++count;
    for (const size_t n : {t + 1, t + atlas.width})
      if (n < atlas.owner.size() && atlas.owner[n] == atlas.owner[t]) {
        q.unevenness += std::pow(value(map, t) - value(before, t) - value(map, n) + value(before, n), 2);
        ++pairs;
      }
  }
  mean /= count;
  q.error = std::sqrt(q.error / count) / mean;
  q.unevenness = std::sqrt(q.unevenness / pairs) / mean;
  return q;
}

// Lookups at the points against those in a map of four times the density, whose texels reach a quarter as far
// from the seam: root mean square over both sides, relative to the mean.
double error_at_seams(const Atlas& atlas, const Lightmap& map, const std::vector<PlainPoint>& points,
                      const Atlas& dense, const Lightmap& truth, const std::vector<PlainPoint>& dense_points,
                      uint32_t first, uint32_t last) {
  double squares = 0, mean = 0, count = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const PlainPoint &p = points[i], &q = dense_points[i];
    if (p.instance[0] < first || p.instance[0] > last) continue;
    const double t = 0.5 * (bilinear(dense, truth, 0, q.page[0], q.texel[0]) +
                            bilinear(dense, truth, 0, q.page[1], q.texel[1]));
    for (int s = 0; s < 2; ++s) {
      squares += std::pow(bilinear(atlas, map, 0, p.page[s], p.texel[s]) - t, 2);
      mean += t;
      ++count;
    }
  }
  return std::sqrt(squares / count) / (mean / count);
}

Bake filled_room(uint32_t samples, float texels_per_metre) {
  Bake room = baked_room(samples, texels_per_metre);
  fill_invalid(room.map, {room.scene, room.atlas, {}});
  return room;
}

void table(float density) {
  const Bake room = filled_room(256, density), reference = filled_room(16384, density),
             dense = filled_room(1024, 4 * density);
  const std::vector<PlainPoint> points = plain_seam_points(room.scene, room.atlas, 1000);
  const std::vector<PlainPoint> dense_points = plain_seam_points(dense.scene, dense.atlas, 1000);
  Lightmap usual = room.map;
  join_seams(usual, room.scene, room.atlas, {});
  const auto print = [&](const Lightmap& map) {
    for (const auto& [first, last] :
         {std::pair{0u, 7u}, {kCylinder, kCylinder}, {kBevelledBox, kBevelledBox}}) {
      const std::vector<PlainPoint> some = of_pieces(points, first, last);
      const Quality q = quality(room.atlas, first, last, room.map, usual, map, reference.map);
      std::printf(
          " %.2f, %.1f, %.1f, %.1f %% |", 100 * plain_steps(room.atlas, map, some).largest,
          100 * error_at_seams(room.atlas, map, points, dense.atlas, dense.map, dense_points, first, last),
          100 * q.error, 100 * q.unevenness);
    }
  };
  std::printf(
      "%g texels per metre; of each piece: largest step, error at seams, error of texels, unevenness\n\n"
      "| seam | slope | reach | close | part | change | most | rounds | wall | cylinder | bevelled box | "
      "moved, "
      "errors |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n| before | | | | | | | |",
      density);
  print(room.map);
  std::printf(" |\n");
  for (const SeamWeights& w : std::vector<SeamWeights>{{},
                                                       {.seam = 64},
                                                       {.seam = 4096},
                                                       {.slope = 0},
                                                       {.slope = 0, .reach = 0},
                                                       {.reach = 6},
                                                       {.doubt = {.close = 2, .part = 4}},
                                                       {.doubt = {.close = 5, .part = 8}},
                                                       {.doubt = {.change = 0}},
                                                       {.doubt = {.change = 1}},
                                                       {.most = 0.5},
                                                       {.most = 2},
                                                       {.rounds = 0}}) {
    Lightmap after = room.map;
    const SeamReport r = join_seams(after, room.scene, room.atlas, {}, w);
    std::printf("| %.0f | %g | %u | %g | %g | %g | %g | %u |", w.seam, w.slope, w.reach, w.doubt.close,
                w.doubt.part, w.doubt.change, w.most, w.rounds);
    print(after);
    std::printf(" %.2f |\n", r.change_in_errors);
  }
}

// A camera at `eye` that looks at `target`.
Camera look_at(const Vec3& eye, const Vec3& target, float fov) {
  Camera c;
  const Vec3 z = normalize_or(eye - target, Vec3(0, 0, 1)),
             x = normalize_or(cross(Vec3(0, 1, 0), z), Vec3(1, 0, 0));
  c.to_world = Mat4x3(x, cross(z, x), z, eye);
  c.vertical_fov = fov;
  return c;
}

// `name`.png: one view before and after, side by side.
bool write_view(const std::filesystem::path& path, const Bake& room, const Lightmap& after,
                const Camera& camera, uint32_t width, uint32_t height) {
  constexpr uint32_t kGap = 8;
  ImportResult imported;
  imported.scene = room.scene;
  std::vector<uint8_t> both(size_t{2 * width + kGap} * height * 3, 255);
  for (const bool second : {false, true}) {
    const Picture p = render_view(imported, room.atlas, second ? after : room.map, camera, width, height);
    for (uint32_t y = 0; y < height; ++y)
      std::copy_n(&p.rgb[size_t{y} * width * 3], width * 3,
                  &both[(size_t{y} * (2 * width + kGap) + (second ? width + kGap : 0)) * 3]);
  }
  const Status s = write_png(path, 2 * width + kGap, height, both);
  if (!s) std::fprintf(stderr, "%s\n", s.error().message.c_str());
  return s.has_value();
}

int pictures(const std::filesystem::path& folder) {
  const auto joined = [](const Bake& room) {
    Lightmap after = room.map;
    join_seams(after, room.scene, room.atlas, {});
    return after;
  };
  const Bake coarse = filled_room(24, 4), room = filled_room(256, 8);
  const bool good = write_view(folder / "seams_wall.png", coarse, joined(coarse),
                               look_at({4.5f, 1.7f, 3.6f}, {4.5f, 1.6f, 0}, 0.75f), 480, 320) &&
                    write_view(folder / "seams_column.png", room, joined(room),
                               look_at({3.4f, 1.0f, 2.9f}, {2.2f, 0.6f, 1.2f}, 0.75f), 400, 400) &&
                    write_view(folder / "seams_box.png", room, joined(room),
                               look_at({3.0f, 1.5f, 2.6f}, {4.1f, 0.5f, 1.1f}, 0.65f), 400, 400);
  return good ? 0 : 1;
}

// count x count panels of 2 x 2 quads and a field with noise: what it costs.
void time_it(uint32_t count) {
  Pieces p;
  const Mesh mesh = panel(1, 1, 2, 2);
  for (uint32_t y = 0; y < count; ++y)
    for (uint32_t x = 0; x < count; ++x) {
      p.scene.instances.push_back(
          {0, 0, moved(Vec3(static_cast<float>(x), static_cast<float>(y), 0)), "panel", 0, 0, 0});
    }
  p.scene.meshes.push_back(mesh);
  p.scene.materials.push_back({"metallic_roughness", "grey", Mat4x3(1.0f), {}});
  const Atlas atlas = packed(p.scene, 8);
  Lightmap map = field_map(p.scene, atlas, [](const DVec3& q, const Vec3&) {
    const double s = q.x * 12.9898 + q.y * 78.233;
    return 1 + 0.1 * (s - std::floor(s));
  });
  for (int k = 0; k < 11; ++k) {  // as many planes as sh_l1 has
    map.planes.add(text("plane {}", k));
    map.planes.data.back() = map.planes.data[0];
  }
  const Stopwatch all;
  const std::vector<BorderEdge> edges = border_edges(p.scene, atlas);
  const double border = all.seconds();
  std::vector<SeamStretch> stretches = coincident_stretches(edges, {});
  const double match = all.seconds() - border;
  const Stopwatch joining;
  const SeamReport r = join_seams(map, p.scene, atlas, {});
  std::printf("| %zu | %zu | %zu | %zu | %.2f s | %.2f s | %.2f s |\n", edges.size(), stretches.size(),
              size_t(r.equations), size_t(r.texels), border, match, joining.seconds());
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  using namespace kiln::test;
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "table" && argc == 3) return table(static_cast<float>(std::atof(argv[2]))), 0;
  if (what == "pictures" && argc == 3) return pictures(argv[2]);
  if (what == "time" && argc > 2) {
    std::printf(
        "| edges | stretches | equations | texels | borders | matching | all |\n"
        "|---|---|---|---|---|---|---|\n");
    for (int i = 2; i < argc; ++i) time_it(static_cast<uint32_t>(std::atoi(argv[i])));
    return 0;
  }
  std::fprintf(stderr, "seams table DENSITY | seams pictures FOLDER | seams time COUNT...\n");
  return 2;
}
