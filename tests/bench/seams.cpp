// Tables and pictures of docs/seams.md:
//   seams table              weights of the solve compared on the room of tests/seams
//   seams pictures FOLDER    the room before and after, as PNG
//   seams time COUNT         COUNT x COUNT panels with a noisy field: edges, unknowns and seconds
#include <cstdio>
#include <cstring>

#include "common/base/clock.h"
#include "coordinator/imageio/imageio.h"
#include "coordinator/post/stage.h"
#include "coordinator/report/preview.h"
#include "coordinator/seams/join.h"
#include "tests/seams/baked_room.h"
#include "tests/seams/pieces.h"
#include "tests/seams/plain_seams.h"

namespace kiln::test {
namespace {

double value(const Lightmap& map, size_t t) {
  return luminance(DVec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t]));
}

// Of texels of instances [first, last]: error against the truth before and after where texels changed, and
// how unevenly neighbours changed, which is what shows as a line along the seam. Root mean squares relative
// to the mean of the truth.
struct Quality {
  double error_before = 0, error_after = 0, unevenness = 0;
};

Quality quality(const Atlas& atlas, uint32_t first, uint32_t last, const Lightmap& before,
                const Lightmap& after, const Lightmap& truth) {
  Quality q;
  double count = 0, pairs = 0, mean = 0;
  const uint32_t from = atlas.instance_first_chart[first], to = atlas.instance_first_chart[last + 1];
  for (size_t t = 0; t < atlas.owner.size(); ++t) {
    if (atlas.owner[t] <= from || atlas.owner[t] > to || before.validity[t] != Validity::kMeasured) continue;
    if (value(after, t) == value(before, t)) continue;
    mean += value(truth, t);
    q.error_before += std::pow(value(before, t) - value(truth, t), 2);
    q.error_after += std::pow(value(after, t) - value(truth, t), 2);
    ++count;
    for (const size_t n : {t + 1, t + atlas.width})
      if (n < atlas.owner.size() && atlas.owner[n] == atlas.owner[t]) {
        q.unevenness += std::pow(value(after, t) - value(before, t) - value(after, n) + value(before, n), 2);
        ++pairs;
      }
  }
  mean /= count;
  q.error_before = std::sqrt(q.error_before / count) / mean;
  q.error_after = std::sqrt(q.error_after / count) / mean;
  q.unevenness = std::sqrt(q.unevenness / pairs) / mean;
  return q;
}

// Lookups at the points against those in a map of four times the density, where the borders of texels are a
// quarter as far from the seam: root mean square over both sides, relative to the mean.
double error_at_seams(const Bake& room, const Lightmap& map, const std::vector<PlainPoint>& points,
                      const Bake& dense, const Lightmap& truth, const std::vector<PlainPoint>& dense_points,
                      uint32_t first, uint32_t last) {
  double squares = 0, mean = 0, count = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const PlainPoint &p = points[i], &q = dense_points[i];
    if (p.instance[0] < first || p.instance[0] > last) continue;
    const double t = 0.5 * (bilinear(dense.atlas, truth, 0, q.page[0], q.texel[0]) +
                            bilinear(dense.atlas, truth, 0, q.page[1], q.texel[1]));
    for (int s = 0; s < 2; ++s) {
      squares += std::pow(bilinear(room.atlas, map, 0, p.page[s], p.texel[s]) - t, 2);
      mean += t;
      ++count;
    }
  }
  return std::sqrt(squares / count) / (mean / count);
}

void table(float density, bool brief) {
  const Bake room = baked_room(256, density), reference = baked_room(brief ? 1024 : 16384, density),
             dense = baked_room(1024, brief ? 48 : 32);
  Lightmap before = room.map, truth = reference.map, fine = dense.map;
  fill_invalid(before, {room.scene, room.atlas, {}});
  fill_invalid(truth, {room.scene, room.atlas, {}});
  fill_invalid(fine, {dense.scene, dense.atlas, {}});
  const std::vector<PlainPoint> points = plain_seam_points(room.scene, room.atlas, 1000);
  const std::vector<PlainPoint> fine_points = plain_seam_points(dense.scene, dense.atlas, 1000);
  const PlainSteps was = plain_steps(room.atlas, before, points);
  const auto print = [&](const Lightmap& after) {
    for (const auto& [first, last] : {std::pair{0u, 7u}, {8u, 8u}, {9u, 9u}}) {
      const Quality q = quality(room.atlas, first, last, before, after, truth);
      std::printf(" %.2f, %.2f, %.2f %% |",
                  100 * error_at_seams(room, after, points, dense, fine, fine_points, first, last),
                  100 * q.error_after, 100 * q.unevenness);
    }
  };
  std::printf(
      "| seam | slope | value | reach | solves | largest step | rms step | wall: at seams, texels, "
      "unevenness | cylinder | bevelled box | moved, errors | bias |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n"
      "| before | | | | | %.2f %% | %.3f %% |",
      100 * was.largest, 100 * was.rms);
  print(before);
  std::printf(" | |\n");
  std::vector<SeamWeights> all;
  for (const double seam : {16.0, 256.0, 4096.0, 65536.0}) all.push_back({.seam = seam});
  for (const double seam : {4096.0, 65536.0, 1048576.0}) all.push_back({.seam = seam, .rounds = 1});
  for (const double v : {1.0, 0.0625, 0.015625}) all.push_back({.value = v});
  all.push_back({.slope = 0, .value = 1});
  for (const uint32_t reach : {2u, 4u, 12u}) all.push_back({.reach = reach});
  if (brief) all = {{.rounds = 1}, {}};
  for (const SeamWeights& w : all) {
    Lightmap after = before;
    const SeamReport r = join_seams(after, room.scene, room.atlas, {}, w);
    const PlainSteps is = plain_steps(room.atlas, after, points);
    std::printf("| %.0f | %g | %g | %u | %u of %u | %.3f %% | %.4f %% |", w.seam, w.slope, w.value, w.reach,
                unsigned(r.rounds), w.rounds, 100 * is.largest, 100 * is.rms);
    print(after);
    std::printf(" %.2f | %.4f %% |\n", r.change_in_errors, 100 * r.bias);
  }
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  using namespace kiln::test;
  if (argc == 2 && !std::strcmp(argv[1], "table")) return table(8, false), 0;
  if (argc == 3 && !std::strcmp(argv[1], "at")) return table(float(atof(argv[2])), true), 0;
  std::fprintf(stderr, "seams table | pictures FOLDER | time COUNT\n");
  return 2;
}
