// Table for docs/unwrap.md: generated solids, then every mesh of the scene files on the command line.
//   unwrap_table [--picture FILE.svg] [SCENE ...]
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "common/unwrap/charts.h"
#include "coordinator/scene/import/import.h"
#include "tests/unwrap/solids.h"

namespace kiln {
namespace {
using namespace test;

struct Row {
  size_t triangles = 0, charts = 0, flips = 0;
  double seconds = 0, squares = 0, area = 0, linf = 1, used = 0, box = 0, twice = 0;
  bool limited = false;
};

void add(Row& row, const Mesh& mesh) {
  const auto begin = std::chrono::steady_clock::now();
  const UnwrapResult made = unwrap(mesh, {});
  row.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const MeshCharts& charts = made.charts;
  row.triangles += mesh.triangles.size();
  row.charts += charts.chart_count;
  row.limited |= !made.limited.empty();
  double area = 0;
  std::vector<DVec2> size(charts.chart_count, DVec2(0.0));
  for (size_t f = 0; f < charts.face_count(); ++f) {
    const Triangle2 t = uv_triangle(charts, f);
    const double twice = area2(t);
    row.flips += twice < 0;
    row.used += 0.5 * std::abs(twice);
    const UVec3& v = mesh.triangles[f];
    area += 0.5 * length(cross(DVec3(mesh.positions[v.y]) - DVec3(mesh.positions[v.x]),
                               DVec3(mesh.positions[v.z]) - DVec3(mesh.positions[v.x])));
    DVec2& s = size[charts.chart_of_face[f]];
    s = glm::max(s, DVec2(t.max_x(), t.max_y()));
  }
  for (const DVec2& s : size) row.box += s.x * s.y;
  row.twice += self_overlap(charts) * area;
  row.squares += made.stretch.l2 * made.stretch.l2 * area;
  row.area += area;
  row.linf = std::max(row.linf, made.stretch.linf);
}

void print(const std::string& name, const Row& row) {
  std::printf("| %s | %zu | %.2f | %zu | %.3f | %.2f | %.0f %% | %.2g %% | %zu |%s\n", name.c_str(),
              row.triangles, row.seconds, row.charts, std::sqrt(row.squares / row.area), row.linf,
              100 * row.used / row.box, 100 * row.twice / row.area, row.flips, row.limited ? " limited" : "");
  std::fflush(stdout);
}

// Charts side by side in rows, a colour each.
void draw(const MeshCharts& charts, const char* path) {
  std::vector<DVec2> size(charts.chart_count, DVec2(0.0)), at(charts.chart_count);
  double all = 0, tallest = 0;
  for (size_t f = 0; f < charts.face_count(); ++f) {
    const Triangle2 t = uv_triangle(charts, f);
    DVec2& s = size[charts.chart_of_face[f]];
    s = glm::max(s, DVec2(t.max_x(), t.max_y()));
  }
  for (const DVec2& s : size) all += s.x * s.y;
  const double width = 1.4 * std::sqrt(all), gap = 0.02 * width;
  DVec2 pen(gap);
  double right = width;
  for (uint32_t c = 0; c < charts.chart_count; ++c) {
    if (pen.x > gap && pen.x + size[c].x > width) pen = DVec2(gap, pen.y + tallest + gap), tallest = 0;
    at[c] = pen;
    pen.x += size[c].x + gap;
    right = std::max(right, pen.x);
    tallest = std::max(tallest, size[c].y);
  }
  const double scale = 900 / right;
  std::ofstream out(path);
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\""
      << (pen.y + tallest + gap) * scale << "\"><rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (size_t f = 0; f < charts.face_count(); ++f) {
    const uint32_t c = charts.chart_of_face[f];
    out << "<path fill=\"hsl(" << (c * 137) % 360
        << ",65%,70%)\" stroke=\"#333\" stroke-width=\"0.25\" d=\"M";
    for (const DVec2& p : uv_triangle(charts, f).c) {
      const DVec2 q = (p + at[c]) * scale;
      out << ' ' << std::round(q.x * 100) / 100 << ' ' << std::round(q.y * 100) / 100;
    }
    out << "Z\"/>\n";
  }
  out << "</svg>\n";
}

int run(int argc, char** argv) {
  int next = 1;
  if (argc > 2 && !std::strcmp(argv[1], "--picture")) {
    draw(unwrap(blob(24), {}).charts, argv[2]);
    next = 3;
  }
  std::printf("| mesh | triangles | s | charts | L2 | Linf | used | overlap | flips |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  if (next == argc)
    for (const Mesh& mesh :
         {box({1, 2, 3}, Uv::kNone), sphere(64, 1), torus(64, 2, 0.7f), terrain(256), tree_of_cones(8),
          letters(9), blob(501), soup(3000, 7), klein(48), tube(64, 32)}) {
      Row row;
      add(row, mesh);
      print(mesh.name, row);
    }
  for (; next < argc; ++next) {
    const std::string path = argv[next];
    const Expected<ImportResult> scene = import_scene(path, {});
    if (!scene) {
      std::fprintf(stderr, "%s\n", scene.error().message.c_str());
      return 1;
    }
    Row row;
    for (const Mesh& mesh : scene->scene.meshes) add(row, mesh);
    print(path.substr(path.rfind('/') + 1), row);
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
