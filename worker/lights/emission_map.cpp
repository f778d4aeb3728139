#include "worker/lights/emission_map.h"

#include <array>

#include "common/math/warp.h"

namespace kiln {
namespace {

constexpr double kCellBudget = 1 << 24;  // for all triangles together; takes half a second
constexpr double kMinCells = 256, kMaxCells = 1 << 16;
constexpr double kFloor = 0x1p-20;   // of the brightest texel, as rounding and dither may reach it
constexpr double kReach = 1.0 / 64;  // texels; beyond the dither of TextureSampler
constexpr double kFarthest = 1e4;    // coordinates beyond it read texel 0, as in TextureSampler
constexpr int kPoints = 32;          // points per side, for triangles without area in texture space

int wrapped(int i, int size, Wrap mode) {
  if (mode == Wrap::kClamp) return std::clamp(i, 0, size - 1);
  const int period = mode == Wrap::kMirror ? 2 * size : size;
  i %= period;
  if (i < 0) i += period;
  return i < size ? i : 2 * size - 1 - i;
}

// A convex polygon; a triangle cut by four lines has at most seven corners.
struct Polygon {
  std::array<DVec2, 8> at;
  size_t size = 0;
};

// The part of the polygon with sign x (coordinate[axis] - limit) <= 0. Sutherland & Hodgman 1974.
Polygon cut(const Polygon& p, int axis, double limit, double sign) {
  Polygon out;
  for (size_t i = 0; i < p.size; ++i) {
    const DVec2 &a = p.at[i], &b = p.at[(i + 1) % p.size];
    const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
    if (da <= 0 && out.size < out.at.size()) out.at[out.size++] = a;
    if ((da < 0) != (db < 0) && da != db && out.size < out.at.size()) {
      DVec2 c = a + (b - a) * (da / (da - db));
      c[axis] = limit;
      out.at[out.size++] = c;
    }
  }
  return out;
}

double cross2(const DVec2& a, const DVec2& b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace

EmissionMap::EmissionMap(const EmissionParts& parts, size_t triangles) : parts_(parts) {
  if (!parts.texture) return;
  const Texture& t = parts.texture->texture();
  wrap_s_ = t.wrap_s;
  wrap_t_ = t.wrap_t;
  nearest_ = t.nearest;
  most_cells_ = std::clamp(kCellBudget / static_cast<double>(triangles), kMinCells, kMaxCells);
  levels_.push_back(load(*parts.texture));
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(halved(levels_.back()));
}

EmissionMap::Level EmissionMap::load(const TextureSampler& sampler) {
  const Texture& t = sampler.texture();
  Level out{static_cast<int>(t.width), static_cast<int>(t.height), {}};
  out.texels.reserve(size_t{t.width} * t.height);
  for (uint32_t y = 0; y < t.height; ++y)
    for (uint32_t x = 0; x < t.width; ++x) out.texels.push_back(sampler.texel(x, y));
  return out;
}

// Each new texel is the mean of those it covers, also for odd sizes.
EmissionMap::Level EmissionMap::halved(const Level& level) {
  Level out{std::max(1, level.width / 2), std::max(1, level.height / 2), {}};
  const double sx = static_cast<double>(level.width) / out.width,
               sy = static_cast<double>(level.height) / out.height;
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      DVec3 sum(0.0);
      const double x0 = x * sx, x1 = x0 + sx, y0 = y * sy, y1 = y0 + sy;
      for (int j = static_cast<int>(y0); j < y1 && j < level.height; ++j)
        for (int i = static_cast<int>(x0); i < x1 && i < level.width; ++i) {
          const double w = (std::min<double>(x1, i + 1) - std::max<double>(x0, i)) *
                           (std::min<double>(y1, j + 1) - std::max<double>(y0, j));
          sum += DVec3(level.texels[static_cast<size_t>(j) * static_cast<size_t>(level.width) +
                                    static_cast<size_t>(i)]) *
                 w;
        }
      out.texels.emplace_back(sum / (sx * sy));
    }
  return out;
}

const Vec3& EmissionMap::texel(const Level& level, int x, int y) const {
  const auto i = static_cast<size_t>(wrapped(x, level.width, wrap_s_));
  const auto j = static_cast<size_t>(wrapped(y, level.height, wrap_t_));
  return level.texels[j * static_cast<size_t>(level.width) + i];
}

double EmissionMap::shade(const Vec3& texture, const Vec3& color) const {
  return luminance(glm::max(DVec3(parts_.factor) * DVec3(color) * DVec3(texture), DVec3(0.0)));
}

// The filter at texel coordinates (x, y) within one cell of the lattice of texel centres (nearest: texels).
Vec3 EmissionMap::filtered(const Level& level, double x, double y, int i, int j) const {
  if (nearest_) return texel(level, i, j);
  const auto a = static_cast<float>(std::clamp(x - 0.5 - i, 0.0, 1.0)),
             b = static_cast<float>(std::clamp(y - 0.5 - j, 0.0, 1.0));
  return (texel(level, i, j) * (1.0f - a) + texel(level, i + 1, j) * a) * (1.0f - b) +
         (texel(level, i, j + 1) * (1.0f - a) + texel(level, i + 1, j + 1) * a) * b;
}

double EmissionMap::mean(const Attributes (&a)[3]) const {
  Vec3 color[3];
  for (int k = 0; k < 3; ++k) color[k] = parts_.vertex_color ? Vec3(a[k].color) : Vec3(1.0f);
  if (!parts_.texture)  // linear over the triangle
    return (shade(Vec3(1.0f), color[0]) + shade(Vec3(1.0f), color[1]) + shade(Vec3(1.0f), color[2])) / 3.0;
  return textured(a, color);
}

double EmissionMap::textured(const Attributes (&a)[3], const Vec3 (&color)[3]) const {
  DVec2 p[3];
  DVec2 low(1e300), high(-1e300);
  for (int k = 0; k < 3; ++k) {
    p[k] = parts_.texture->placed(a[k].uv);
    for (int c = 0; c < 2; ++c)
      if (!(std::abs(p[k][c]) < kFarthest)) p[k][c] = 0;
    low = glm::min(low, p[k]);
    high = glm::max(high, p[k]);
  }
  // The finest level at which the triangle fits the budget.
  size_t l = 0;
  const auto cells = [&](const Level& level) {
    return ((high.x - low.x) * level.width + 2) * ((high.y - low.y) * level.height + 2);
  };
  while (l + 1 < levels_.size() && cells(levels_[l]) > most_cells_) ++l;
  const Level& level = levels_[l];
  if (cells(level) > kMaxCells) {  // too many texture repeats: use the mean of the image
    return (shade(level.texels[0], color[0]) + shade(level.texels[0], color[1]) +
            shade(level.texels[0], color[2])) /
           3.0;
  }
  const DVec2 size(level.width, level.height);
  for (DVec2& corner : p) corner *= size;
  const bool flat = !(std::abs(cross2(p[1] - p[0], p[2] - p[0])) > 1e-6);
  return flat ? over_points(level, p, color) : over_cells(level, p, color);
}

double EmissionMap::over_cells(const Level& level, const DVec2 (&p)[3], const Vec3 (&color)[3]) const {
  const double whole = cross2(p[1] - p[0], p[2] - p[0]);
  const double shift = nearest_ ? 0.0 : 0.5;
  Polygon triangle;
  for (const DVec2& corner : p) triangle.at[triangle.size++] = corner;
  const auto bound = [&](int axis, bool upper) {
    const double a = p[0][axis], b = p[1][axis], c = p[2][axis];
    return static_cast<int>(
        std::floor((upper ? std::max({a, b, c}) + kReach : std::min({a, b, c}) - kReach) - shift));
  };
  const auto color_at = [&](const DVec2& q) {
    const auto b1 = static_cast<float>(cross2(q - p[0], p[2] - p[0]) / whole);
    const auto b2 = static_cast<float>(cross2(p[1] - p[0], q - p[0]) / whole);
    return color[0] * (1.0f - b1 - b2) + color[1] * b1 + color[2] * b2;
  };
  const Vec3 brightest_color = glm::max(color[0], glm::max(color[1], color[2]));
  double sum = 0, brightest = 0;
  for (int j = bound(1, false); j <= bound(1, true); ++j) {
    const Polygon above = cut(triangle, 1, j + shift - kReach, -1),
                  row = cut(above, 1, j + shift + 1 + kReach, 1);
    for (int i = bound(0, false); i <= bound(0, true) && row.size; ++i) {
      const Polygon left = cut(row, 0, i + shift - kReach, -1),
                    near = cut(left, 0, i + shift + 1 + kReach, 1);
      if (near.size == 0) continue;
      const int more = nearest_ ? 0 : 1;
      for (int y = 0; y <= more; ++y)
        for (int x = 0; x <= more; ++x)
          brightest = std::max(brightest, shade(texel(level, i + x, j + y), brightest_color));
      Polygon cell = cut(near, 0, i + shift, -1);
      cell = cut(cell, 0, i + shift + 1, 1);
      cell = cut(cell, 1, j + shift, -1);
      cell = cut(cell, 1, j + shift + 1, 1);
      for (size_t k = 2; k < cell.size; ++k) {
        const DVec2 &a = cell.at[0], &b = cell.at[k - 1], &c = cell.at[k];
        // The midpoints of the edges: exact up to degree two.
        for (const DVec2& q : {0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)})
          sum += std::abs(cross2(b - a, c - a)) / 3.0 * shade(filtered(level, q.x, q.y, i, j), color_at(q));
      }
    }
  }
  return std::max(sum / std::abs(whole), kFloor * brightest);
}

double EmissionMap::over_points(const Level& level, const DVec2 (&p)[3], const Vec3 (&color)[3]) const {
  const double shift = nearest_ ? 0.0 : 0.5;
  double sum = 0, brightest = 0;
  for (int y = 0; y < kPoints; ++y)
    for (int x = 0; x < kPoints; ++x) {
      const Vec2 b = uniform_triangle((Vec2(x, y) + 0.5f) / static_cast<float>(kPoints));
      const double b1 = b.x, b2 = b.y;
      const DVec2 q = p[0] * (1 - b1 - b2) + p[1] * b1 + p[2] * b2;
      const int i = static_cast<int>(std::floor(q.x - shift)), j = static_cast<int>(std::floor(q.y - shift));
      sum += shade(filtered(level, q.x, q.y, i, j),
                   color[0] * (1 - b.x - b.y) + color[1] * b.x + color[2] * b.y);
    }
  const DVec2 low = glm::min(p[0], glm::min(p[1], p[2])), high = glm::max(p[0], glm::max(p[1], p[2]));
  const Vec3 brightest_color = glm::max(color[0], glm::max(color[1], color[2]));
  for (int j = static_cast<int>(std::floor(low.y - 0.5 - kReach)); j <= std::floor(high.y + 0.5 + kReach);
       ++j)
    for (int i = static_cast<int>(std::floor(low.x - 0.5 - kReach)); i <= std::floor(high.x + 0.5 + kReach);
         ++i)
      brightest = std::max(brightest, shade(texel(level, i, j), brightest_color));
  return std::max(sum / (kPoints * kPoints), kFloor * brightest);
}

}  // namespace kiln
