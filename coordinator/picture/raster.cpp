#include "coordinator/picture/raster.h"

#include <algorithm>
#include <array>

#include "common/base/parallel.h"

namespace kiln {
namespace {

struct ClipVertex {
  Vec3 p;        // camera space, looking along -z
  float b1, b2;  // barycentrics in the whole triangle
};

struct ScreenTriangle {
  std::array<Vec2, 3> xy;  // pixels
  std::array<float, 3> w;  // 1 / depth
  std::array<Vec2, 3> b;   // barycentrics, times w
  uint32_t instance, triangle;
  bool back;
};

// Cuts a triangle at the near plane: 0, 3 or 4 vertices.
int clip_near(const std::array<ClipVertex, 3>& in, float near, std::array<ClipVertex, 4>& out) {
  int n = 0;
  for (int i = 0; i < 3; ++i) {
    const ClipVertex &a = in[i], &b = in[(i + 1) % 3];
    const float da = -a.p.z - near, db = -b.p.z - near;
    if (da >= 0) out[n++] = a;
    if ((da >= 0) != (db >= 0)) {
      const float t = da / (da - db);
      out[n++] = {a.p + (b.p - a.p) * t, a.b1 + (b.b1 - a.b1) * t, a.b2 + (b.b2 - a.b2) * t};
    }
  }
  return n;
}

class Projector {
 public:
  Projector(const Camera& camera, uint32_t width, uint32_t height)
      : origin_(camera.to_world[3]),
        x_(normalize_or(camera.to_world[0], Vec3(1, 0, 0))),
        y_(normalize_or(camera.to_world[1], Vec3(0, 1, 0))),
        z_(normalize_or(camera.to_world[2], Vec3(0, 0, 1))),
        half_(0.5f * Vec2(width, height)),
        focal_(half_.y / std::tan(0.5f * camera.vertical_fov)) {}
  Vec3 to_camera(const Vec3& p) const {
    const Vec3 d = p - origin_;
    return {dot(d, x_), dot(d, y_), dot(d, z_)};
  }
  Vec2 to_pixels(const Vec3& c) const { return half_ + Vec2(c.x, -c.y) * (focal_ / -c.z); }
  // Whether all three points (camera space) are outside one side of the view or before the near plane.
  bool outside(const std::array<ClipVertex, 3>& v, float near) const {
    const auto all = [&](const auto& beyond) { return beyond(v[0].p) && beyond(v[1].p) && beyond(v[2].p); };
    return all([&](const Vec3& p) { return -p.z < near; }) ||
           all([&](const Vec3& p) { return p.x * focal_ > -p.z * half_.x; }) ||
           all([&](const Vec3& p) { return -p.x * focal_ > -p.z * half_.x; }) ||
           all([&](const Vec3& p) { return p.y * focal_ > -p.z * half_.y; }) ||
           all([&](const Vec3& p) { return -p.y * focal_ > -p.z * half_.y; });
  }

 private:
  Vec3 origin_, x_, y_, z_;
  Vec2 half_;
  float focal_;
};

void project_triangle(const Projector& projector, const Vec3 (&world)[3], uint32_t instance,
                      uint32_t triangle, bool mirrored, float near, std::vector<ScreenTriangle>& out) {
  std::array<ClipVertex, 3> in{ClipVertex{projector.to_camera(world[0]), 0, 0},
                               ClipVertex{projector.to_camera(world[1]), 1, 0},
                               ClipVertex{projector.to_camera(world[2]), 0, 1}};
  if (projector.outside(in, near)) return;
  const Vec3 normal = cross(in[1].p - in[0].p, in[2].p - in[0].p);
  const bool back = (dot(normal, in[0].p) > 0) != mirrored;
  std::array<ClipVertex, 4> poly;
  const int n = clip_near(in, near, poly);
  for (int k = 1; k + 1 < n; ++k) {
    ScreenTriangle s{{}, {}, {}, instance, triangle, back};
    const int order[3] = {0, k, k + 1};
    for (int c = 0; c < 3; ++c) {
      const ClipVertex& v = poly[order[c]];
      s.xy[c] = projector.to_pixels(v.p);
      s.w[c] = -1.0f / v.p.z;
      s.b[c] = Vec2(v.b1, v.b2) * s.w[c];
    }
    out.push_back(s);
  }
}

std::vector<ScreenTriangle> project(const Scene& scene, const Projector& projector, float near) {
  constexpr uint32_t kRun = 1 << 14;
  struct Run {
    uint32_t instance, first, end;
    std::vector<ScreenTriangle> out;
  };
  std::vector<Run> runs;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const auto count = static_cast<uint32_t>(scene.meshes[scene.instances[i].mesh].triangles.size());
    for (uint32_t t = 0; t < count; t += kRun) runs.push_back({i, t, std::min(count, t + kRun), {}});
  }
  parallel_for(runs.size(), [&](size_t r) {
    Run& run = runs[r];
    const Instance& instance = scene.instances[run.instance];
    const Mesh& mesh = scene.meshes[instance.mesh];
    const bool mirrored = determinant(instance.to_world) < 0;
    for (uint32_t t = run.first; t < run.end; ++t) {
      Vec3 world[3];
      for (int c = 0; c < 3; ++c)
        world[c] = transform_point(instance.to_world, mesh.positions[mesh.triangles[t][c]]);
      project_triangle(projector, world, run.instance, t, mirrored, near, run.out);
    }
  });
  std::vector<ScreenTriangle> out;
  for (const Run& run : runs) out.insert(out.end(), run.out.begin(), run.out.end());
  return out;
}

// In double: a triangle clipped at the near plane may have corners a million pixels away.
double edge(const Vec2& a, const Vec2& b, const Vec2& p) {
  return (double{b.x} - a.x) * (double{p.y} - a.y) - (double{b.y} - a.y) * (double{p.x} - a.x);
}

// The pixels of a row in [left, right) that may lie inside: those on the inner side of every edge,
// plus one at each end for rounding.
std::pair<uint32_t, uint32_t> inside_row(const ScreenTriangle& s, double area, uint32_t left, uint32_t right,
                                         float y) {
  double low = left, high = right;
  for (size_t k = 0; k < 3; ++k) {
    const Vec2 &a = s.xy[k], &b = s.xy[(k + 1) % 3];
    const double slope = -(double{b.y} - a.y) / area;
    const double at_zero = edge(a, b, Vec2(0, y)) / area;
    const double zero = -at_zero / slope - 0.5;  // pixel whose centre is on the edge
    if (!std::isfinite(zero)) continue;
    if (slope > 0) low = std::max(low, std::floor(zero) - 1);
    if (slope < 0) high = std::min(high, std::ceil(zero) + 2);
  }
  if (!(low < high)) return {left, left};
  return {static_cast<uint32_t>(low), static_cast<uint32_t>(high)};
}

void fill(const ScreenTriangle& s, View& view, uint32_t row_begin, uint32_t row_end,
          const std::function<bool(const Fragment&)>& visible) {
  const double area = edge(s.xy[0], s.xy[1], s.xy[2]);
  if (area == 0 || !std::isfinite(area)) return;
  const auto clamp_to = [](float v, uint32_t low, uint32_t high) {
    return static_cast<uint32_t>(std::clamp(v, static_cast<float>(low), static_cast<float>(high)));
  };
  const auto [x0, x1] = std::minmax({s.xy[0].x, s.xy[1].x, s.xy[2].x});
  const auto [y0, y1] = std::minmax({s.xy[0].y, s.xy[1].y, s.xy[2].y});
  const uint32_t left = clamp_to(x0, 0, view.width), right = clamp_to(x1 + 1, 0, view.width);
  const uint32_t top = clamp_to(y0, row_begin, row_end), bottom = clamp_to(y1 + 1, row_begin, row_end);
  for (uint32_t y = top; y < bottom; ++y) {
    const auto [first, end] = inside_row(s, area, left, right, static_cast<float>(y) + 0.5f);
    for (uint32_t x = first; x < end; ++x) {
      const Vec2 p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const double d0 = edge(s.xy[1], s.xy[2], p) / area, d1 = edge(s.xy[2], s.xy[0], p) / area;
      if (d0 < 0 || d1 < 0 || d0 + d1 > 1) continue;
      const auto l0 = static_cast<float>(d0), l1 = static_cast<float>(d1),
                 l2 = static_cast<float>(1 - d0 - d1);
      Fragment f;
      f.inverse_depth = l0 * s.w[0] + l1 * s.w[1] + l2 * s.w[2];
      Fragment& target = view.fragments[size_t{y} * view.width + x];
      if (f.inverse_depth <= target.inverse_depth) continue;
      const Vec2 b = (s.b[0] * l0 + s.b[1] * l1 + s.b[2] * l2) / f.inverse_depth;
      f.instance = s.instance;
      f.triangle = s.triangle;
      f.b1 = b.x;
      f.b2 = b.y;
      f.back = s.back;
      if (visible(f)) target = f;
    }
  }
}

// The triangles that overlap each band of rows, in order.
std::vector<std::vector<uint32_t>> bands_of(const std::vector<ScreenTriangle>& triangles, size_t bands,
                                            uint32_t height) {
  std::vector<std::vector<uint32_t>> lists(bands);
  const auto band_of = [&](float y) {
    const double row = std::clamp(double{y}, 0.0, height - 1.0);
    return std::min(bands - 1, static_cast<size_t>(row * static_cast<double>(bands) / height));
  };
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    const auto& xy = triangles[i].xy;
    const auto [y0, y1] = std::minmax({xy[0].y, xy[1].y, xy[2].y});
    if (!(y1 >= 0 && y0 <= static_cast<float>(height))) continue;
    const size_t from = band_of(y0 - 1), to = band_of(y1 + 1);
    for (size_t band = from; band <= to; ++band) lists[band].push_back(i);
  }
  return lists;
}

}  // namespace

View rasterise(const Scene& scene, const Camera& camera, uint32_t width, uint32_t height,
               const std::function<bool(const Fragment&)>& visible) {
  View view{width, height, std::vector<Fragment>(size_t{width} * height)};
  // The near plane: a ten-thousandth of the distance to the scene's far corner.
  float reach = 0;
  for (const Instance& i : scene.instances)
    reach = std::max(reach, length(i.to_world[3] - camera.to_world[3]));
  const Projector projector(camera, width, height);
  const std::vector<ScreenTriangle> triangles = project(scene, projector, std::max(1e-3f, 1e-4f * reach));
  const size_t bands = std::min<size_t>(64, height);
  const std::vector<std::vector<uint32_t>> lists = bands_of(triangles, bands, height);
  parallel_for(bands, [&](size_t band) {
    const auto begin = static_cast<uint32_t>(band * height / bands);
    const auto end = static_cast<uint32_t>((band + 1) * height / bands);
    for (const uint32_t i : lists[band]) fill(triangles[i], view, begin, end, visible);
  });
  return view;
}

}  // namespace kiln
