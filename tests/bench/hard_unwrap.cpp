// Table of docs/unwrap.md: charts and packing of hard meshes, ours and another's, measured by the same code.
//   hard_unwrap --write DIR [SCENE ...]     meshes for tests/compare/xatlas.mjs: DIR/NAME.mesh
//   hard_unwrap [--foreign DIR] [SCENE ...] the table; DIR/NAME.xatlas adds rows
#include <cstdio>
#include <cstring>
#include <ctime>

#include "common/atlas/layout.h"
#include "common/base/files.h"
#include "common/raster/bit_image.h"
#include "common/raster/footprint.h"
#include "coordinator/scene/import/import.h"
#include "tests/unwrap/hard_meshes.h"

namespace kiln {
namespace {
using namespace test;

struct Case {
  std::string name;
  Scene scene;
  float density;  // texels a metre
};

// Faces on pages, in texels.
struct Laid {
  std::vector<Triangle2> flat;
  std::vector<uint32_t> chart, page;
  std::vector<std::array<DVec3, 3>> corners;  // metres of the world
  uint64_t texels = 0;
  uint32_t width = 0, height = 0, pages = 0;
  double seconds = 0, density = 0;
};

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::array<DVec3, 3> corners_of(const Scene& scene, const Instance& instance, const UVec3& t) {
  const Mesh& mesh = scene.meshes[instance.mesh];
  std::array<DVec3, 3> c;
  for (int k = 0; k < 3; ++k)
    c[static_cast<size_t>(k)] = DVec3(transform_point(instance.to_world, mesh.positions[t[k]]));
  return c;
}

Laid ours(const Case& c) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = c.density;
  settings.cut_contacts = false;
  settings.unwrap.always = true;
  settings.threads = 1;
  settings.max_page_size = 16384;
  Laid laid;
  const double begin = processor_seconds();
  const Expected<Atlas> atlas = pack_layout(c.scene, settings);
  laid.seconds = processor_seconds() - begin;
  if (!atlas) return std::fprintf(stderr, "%s\n", atlas.error().message.c_str()), laid;
  laid.width = atlas->width, laid.height = atlas->height, laid.pages = atlas->pages;
  laid.density = c.density;
  for (size_t i = 0; i < c.scene.instances.size(); ++i) {
    const MeshCharts& charts = atlas->of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const uint32_t p = atlas->instance_first_chart[i] + charts.chart_of_face[f];
      laid.flat.push_back(texel_triangle(charts, atlas->placements[p], f));
      laid.chart.push_back(p);
      laid.page.push_back(atlas->placements[p].page);
      const Mesh& mesh = c.scene.meshes[c.scene.instances[i].mesh];
      laid.corners.push_back(corners_of(c.scene, c.scene.instances[i], mesh.triangles[f]));
    }
  }
  return laid;
}

Bytes meshes_of(const Case& c) {
  ByteWriter w;
  w.put(c.density);
  w.put(static_cast<uint32_t>(c.scene.instances.size()));
  for (const Instance& instance : c.scene.instances) {
    const Mesh& mesh = c.scene.meshes[instance.mesh];
    w.put(static_cast<uint32_t>(mesh.positions.size()));
    w.put(static_cast<uint32_t>(mesh.triangles.size()));
    for (const Vec3& p : mesh.positions) w.put(transform_point(instance.to_world, p));
    for (const Vec3& n : mesh.normals) w.put(n);
    for (const UVec3& t : mesh.triangles) w.put(t);
  }
  return w.take();
}

std::optional<Laid> foreign(const Case& c, const std::string& path) {
  const Expected<Bytes> bytes = read_file(path, uint64_t{1} << 32);
  if (!bytes) return std::nullopt;
  ByteReader r(*bytes);
  Laid laid;
  laid.width = r.get<uint32_t>(), laid.height = r.get<uint32_t>(), laid.pages = r.get<uint32_t>();
  laid.density = double{r.get<float>()};
  laid.seconds = r.get<double>();
  for (const Instance& instance : c.scene.instances) {
    const std::vector<UVec3>& triangles = c.scene.meshes[instance.mesh].triangles;
    for (const UVec3& t : triangles) {
      Triangle2 flat;
      for (DVec2& p : flat.c) p.x = double{r.get<float>()}, p.y = double{r.get<float>()};
      laid.flat.push_back(flat);
      laid.corners.push_back(corners_of(c.scene, instance, t));
    }
    for (size_t t = 0; t < triangles.size(); ++t) laid.chart.push_back(r.get<uint32_t>());
  }
  laid.page.assign(laid.chart.size(), 0);
  return laid;
}

// Stretch of Sander et al. 2001: L2 relative to the density that was reached on average (its least value is
// 1), `worst` to the density that was asked for.
struct Measured {
  size_t charts = 0, flat_faces = 0;
  double area = 0, laid = 0, l2 = 0, worst = 0, touched = 0, shared = 0;
};

Measured measure(const Laid& laid) {
  Measured m;
  std::vector<uint32_t> ids;
  std::vector<std::pair<double, double>> of_chart;  // squares, area
  std::vector<BitImage> pages(laid.pages, BitImage(laid.width, laid.height));
  double squares = 0;
  for (size_t f = 0; f < laid.flat.size(); ++f) {
    const auto& q = laid.corners[f];
    const Triangle2& t = laid.flat[f];
    const double area = 0.5 * length(cross(q[1] - q[0], q[2] - q[0])), twice = area2(t);
    const double longest = std::max({length(q[1] - q[0]), length(q[2] - q[1]), length(q[0] - q[2])});
    if (!(2 * area > 1e-6 * longest * longest) || laid.chart[f] == ~0u) continue;
    ids.push_back(laid.chart[f]);
    m.area += area;
    if (laid.page[f] < pages.size())
      for_each_footprint_span(t, laid.width, laid.height, [&](uint32_t y, uint32_t x0, uint32_t x1) {
        pages[laid.page[f]].set_span(y, x0, x1);
      });
    if (std::abs(twice) < 1e-9) {
      ++m.flat_faces;
      continue;
    }
    const DVec3 ds =
        (q[0] * (t.c[1].y - t.c[2].y) + q[1] * (t.c[2].y - t.c[0].y) + q[2] * (t.c[0].y - t.c[1].y)) / twice;
    const DVec3 dt =
        (q[0] * (t.c[2].x - t.c[1].x) + q[1] * (t.c[0].x - t.c[2].x) + q[2] * (t.c[1].x - t.c[0].x)) / twice;
    const double d2 = laid.density * laid.density;
    const double a = d2 * dot(ds, ds), b = d2 * dot(ds, dt), c = d2 * dot(dt, dt);
    squares += 0.5 * (a + c) * area;
    m.laid += 0.5 * std::abs(twice) / d2;
    m.worst = std::max(m.worst, std::sqrt(0.5 * (a + c + std::sqrt((a - c) * (a - c) + 4 * b * b))));
  }
  std::sort(ids.begin(), ids.end());
  m.charts = static_cast<size_t>(std::unique(ids.begin(), ids.end()) - ids.begin());
  m.l2 = std::sqrt(squares / m.area * m.laid / m.area);
  for (const BitImage& page : pages) m.touched += static_cast<double>(page.count());
  return m;
}

void print(const Case& c, const char* who, const Laid& laid) {
  const Measured m = measure(laid);
  const double texels = double{1} * laid.width * laid.height * laid.pages;
  std::printf("| %s | %s | %zu | %zu | %u x %u x %u | %.1f %% | %.1f %% | %.3f | %.2f | %.2f |\n",
              c.name.c_str(), who, laid.flat.size(), m.charts, laid.width, laid.height, laid.pages,
              100 * m.area * laid.density * laid.density / texels, 100 * m.touched / texels, m.l2, m.worst,
              laid.seconds);
  if (m.flat_faces) std::printf("faces without area: %zu\n", m.flat_faces);
  std::fflush(stdout);
}

std::vector<Case> cases(int count, char** paths) {
  std::vector<Case> all;
  all.push_back({"vehicle", scene_of({vehicle(500)}), 40});
  all.push_back({"height_field", scene_of({height_field(223)}), 8});
  all.push_back({"cave", scene_of({cave(156)}), 10});
  for (int i = 0; i < count; ++i) {
    Expected<ImportResult> scene = import_scene(paths[i], {});
    if (!scene) {
      std::fprintf(stderr, "%s\n", scene.error().message.c_str());
      continue;
    }
    const std::string path = paths[i];
    const size_t slash = path.rfind('/') + 1;
    all.push_back({path.substr(slash, path.rfind('.') - slash), std::move(scene->scene), 16});
  }
  return all;
}

int run(int argc, char** argv) {
  const bool write = argc > 2 && !std::strcmp(argv[1], "--write"),
             compare = argc > 2 && !std::strcmp(argv[1], "--foreign");
  const int first = write || compare ? 3 : 1;
  if (!write) {
    std::printf("| mesh | by | triangles | charts | atlas | surface | footprints | L2 | worst | CPU s |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|\n");
  }
  for (const Case& c : cases(argc - first, argv + first)) {
    const std::string stem = write || compare ? std::string(argv[2]) + "/" + c.name : "";
    if (write) {
      if (!write_file_atomic(stem + ".mesh", meshes_of(c))) return 1;
      continue;
    }
    print(c, "Kiln", ours(c));
    if (!compare) continue;
    if (const std::optional<Laid> other = foreign(c, stem + ".xatlas")) print(c, "xatlas", *other);
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
