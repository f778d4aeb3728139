#include "coordinator/report/probe_places_view.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/format.h"
#include "coordinator/picture/label.h"
#include "coordinator/scene/probes/bricks.h"

namespace kiln {
namespace {

constexpr uint32_t kWidth = 960, kMargin = 24, kGap = 40, kMaxHeight = 1100, kLine = 20;
constexpr double kFine = kSupersample;
const Vec3 kBackground(24), kEdges(120);
constexpr std::array<uint8_t, 3> kWords{230, 230, 230};
const Vec3 kStateColor[] = {Vec3(235), Vec3(255, 154, 31), Vec3(255, 0, 255)};  // those of the viewer
constexpr const char* kStateName[] = {"active", "moved", "inside geometry"};

Vec3 brick_color(uint32_t level) {
  return glm::mix(Vec3(38, 60, 105), Vec3(90, 150, 215), std::pow(0.55f, static_cast<float>(level)));
}

std::array<uint8_t, 3> bytes(const Vec3& c) {
  return {static_cast<uint8_t>(c.x), static_cast<uint8_t>(c.y), static_cast<uint8_t>(c.z)};
}

// Pixels of the large picture.
class Canvas {
 public:
  Canvas(uint32_t width, uint32_t height)
      : width_(width), height_(height), color_(size_t{width} * height, kBackground), edges_(color_.size()) {}

  void blend(double x, double y, const Vec3& color, float share) {
    if (Vec3* const p = at(x, y)) *p += (color - *p) * share;
  }
  // Visits pixels along a line.
  template <class Visit>
  static void walk(const DVec2& a, const DVec2& b, const Visit& visit) {
    const DVec2 d = b - a;
    const int steps = 1 + static_cast<int>(std::max(std::abs(d.x), std::abs(d.y)));
    for (int i = 0; i <= steps; ++i) visit(a + d * (static_cast<double>(i) / steps));
  }
  void edge(const DVec2& a, const DVec2& b) {
    walk(a, b, [&](const DVec2& p) {
      if (const Vec3* const at_p = at(p.x, p.y)) edges_[static_cast<size_t>(at_p - color_.data())] += 1;
    });
  }
  // The more edges lie on a pixel, the brighter it is.
  void settle_edges() {
    for (size_t i = 0; i < color_.size(); ++i)
      color_[i] += (kEdges - color_[i]) * (1 - std::exp(-0.3f * edges_[i]));
    std::fill(edges_.begin(), edges_.end(), 0.0f);
  }
  void rectangle(const DVec2& low, const DVec2& high, const Vec3& color) {
    const DVec2 corner[] = {low, {high.x, low.y}, high, {low.x, high.y}};
    for (int k = 0; k < 4; ++k)
      walk(corner[k], corner[(k + 1) % 4], [&](const DVec2& p) { blend(p.x, p.y, color, 1); });
  }
  void dot(const DVec2& centre, double radius, const Vec3& color) {
    for (double y = std::floor(centre.y - radius); y <= centre.y + radius; ++y)
      for (double x = std::floor(centre.x - radius); x <= centre.x + radius; ++x)
        if (length(DVec2(x, y) - centre) <= radius) blend(x, y, color, 1);
  }
  const Vec3& operator[](size_t i) const { return color_[i]; }

 private:
  Vec3* at(double x, double y) {
    if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return nullptr;
    return &color_[static_cast<size_t>(y) * width_ + static_cast<size_t>(x)];
  }
  const uint32_t width_, height_;
  std::vector<Vec3> color_;
  std::vector<float> edges_;
};

// A view of the world on the canvas: along z (top view) or y (side view) as the picture's second axis.
struct Projection2 {
  int axis;      // of the world, shown downwards or upwards
  double sign;   // -1: upwards
  DVec2 origin;  // on the canvas
  double scale;
  DVec2 of(const DVec3& p) const { return origin + DVec2(p.x, sign * p[axis]) * scale; }
};

void draw_bricks(Canvas& canvas, const Projection2& view, const ProbeVolume& v) {
  for (uint32_t level = v.levels; level-- > 0;)  // the finest last
    for (const ProbeBrick& b : v.bricks) {
      if (b.level != level || b.children) continue;
      canvas.rectangle(view.of(v.place(b.corner)), view.of(v.place(b.corner + UVec3(b.size()))),
                       brick_color(level));
    }
}

void draw_probes(Canvas& canvas, const Projection2& view, const ProbeLayout& layout, double spacing) {
  std::map<std::pair<int, int>, std::pair<Vec3, float>> dots;
  for (size_t i = 0; i < layout.size(); ++i) {
    const DVec2 p = view.of(DVec3(layout.place[i]));
    auto& [sum, count] = dots[{static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y))}];
    sum += kStateColor[static_cast<size_t>(layout.state[i])];
    count += 1;
  }
  const double radius = std::clamp(0.14 * spacing * view.scale, 1.0, 3.0 * kFine);
  for (const auto& [pixel, mean] : dots)
    canvas.dot(DVec2(pixel.first, pixel.second), radius, mean.first / mean.second);
}

// Below the views: what colours mean, and a scale.
void draw_legend(Picture& picture, const ProbeLayout& layout, uint32_t top, double scale) {
  uint32_t left = kMargin;
  const auto entry = [&](const Vec3& color, const std::string& words) {
    for (uint32_t y = 0; y < 10; ++y)
      for (uint32_t x = 0; x < 10; ++x)
        if (left + x < picture.width) picture.set(left + x, top + y, bytes(color));
    draw_label(picture, left + 16, top + 2, 1, words, kWords);
    left += 16 + label_width(1, words) + 22;
  };
  for (size_t s = 0; s < std::size(kStateName); ++s)
    entry(kStateColor[s],
          text("{} {}", std::count(layout.state.begin(), layout.state.end(), static_cast<ProbeState>(s)),
               kStateName[s]));
  double finest = layout.volumes.front().spacing;
  uint32_t levels = 1;
  for (const ProbeVolume& v : layout.volumes) {
    finest = std::min(finest, v.spacing);
    levels = std::max(levels, v.levels);
  }
  for (uint32_t level = 0; level < std::min(levels, 4u); ++level)
    entry(brick_color(level), layout.volumes.size() == 1
                                  ? text("bricks, {:.4g} m apart", finest * static_cast<double>(1u << level))
                                  : text("bricks of level {}", level));
  const double most = 200 / scale, power = std::pow(10, std::floor(std::log10(most)));
  const double metres = power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);  // 80 to 200 pixels
  const auto length = static_cast<uint32_t>(metres * scale);
  for (uint32_t x = 0; x < length; ++x)
    for (uint32_t y = 0; y < 2; ++y) picture.set(kMargin + x, top + kLine + 4 + y, kWords);
  draw_label(picture, kMargin + length + 8, top + kLine + 1, 1, text("{:g} m", metres), kWords);
}

}  // namespace

Picture probe_places_picture(const Scene& scene, const ProbeLayout& layout) {
  DVec3 low(1e300), high(-1e300);
  const std::vector<SolidTriangle> triangles = world_triangles(scene);
  for (const SolidTriangle& t : triangles)
    for (const DVec3& p : t.corner) low = glm::min(low, p), high = glm::max(high, p);
  double spacing = layout.volumes.front().spacing;
  for (const ProbeVolume& v : layout.volumes) {
    low = glm::min(low, v.low), high = glm::max(high, v.high());
    spacing = std::min(spacing, v.spacing);
  }
  const DVec3 size = glm::max(high - low, DVec3(1e-6));
  const double scale =
      std::min((kWidth - 2.0 * kMargin) / size.x, (kMaxHeight - 2.0 * kGap) / (size.y + size.z));
  const auto top = static_cast<uint32_t>(std::ceil(size.z * scale)),
             side = static_cast<uint32_t>(std::ceil(size.y * scale));
  const uint32_t height = kGap + top + kGap + side + kMargin;
  Canvas canvas(kWidth * kSupersample, height * kSupersample);
  const double fine = scale * kFine, left = 0.5 * (kWidth - size.x * scale) * kFine;
  const Projection2 views[] = {
      {2, 1, DVec2(left - low.x * fine, kGap * kFine - low.z * fine), fine},
      {1, -1, DVec2(left - low.x * fine, (kGap + top + kGap) * kFine + high.y * fine), fine}};
  for (const Projection2& view : views) {
    for (const ProbeVolume& v : layout.volumes) draw_bricks(canvas, view, v);
    for (const SolidTriangle& t : triangles)
      for (int k = 0; k < 3; ++k) canvas.edge(view.of(t.corner[k]), view.of(t.corner[(k + 1) % 3]));
  }
  canvas.settle_edges();
  for (const Projection2& view : views) draw_probes(canvas, view, layout, spacing);
  Picture picture(kWidth, height + 2 * kLine + kMargin, static_cast<uint8_t>(kBackground.x));
  picture.paste(supersampled(kWidth, height, kSupersample, [&](size_t pixel) { return canvas[pixel]; }), 0,
                0);
  draw_label(picture, kMargin, kGap - 20, 1, "from above: x to the right, z down", kWords);
  draw_label(picture, kMargin, kGap + top + kGap - 20, 1, "from the side: x to the right, y up", kWords);
  draw_legend(picture, layout, height, scale);
  return picture;
}

}  // namespace kiln
