// Points of cut triangles are found in the same part by the tree as by looking at all parts in turn.
#include "common/atlas/atlas_lookup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace kiln {
namespace {

// An atlas of one instance with these parts.
Atlas atlas_of(std::vector<FacePart> parts) {
  Atlas atlas;
  atlas.charts.resize(1);
  atlas.charts[0].parts = std::move(parts);
  atlas.charts_of_instance = {0};
  return atlas;
}

// Splits parts of triangle `triangle` at points inside and on edges, and most often the latest ones, so that
// some corners have many small parts.
std::vector<FacePart> split(uint32_t triangle, size_t count, std::mt19937& random) {
  std::vector<FacePart> parts{{triangle}};
  std::uniform_real_distribution<float> unit(0.05f, 0.95f);
  while (parts.size() < count) {
    const size_t first = random() % 3 ? 0 : parts.size() - std::min<size_t>(parts.size(), 4);
    const size_t at = first + random() % (parts.size() - first);
    const FacePart whole = parts[at];
    const Vec2* const c = whole.corner;
    const float s = unit(random), t = unit(random);
    const uint32_t k = random() % 3;
    if (random() % 2) {  // into three
      const Vec2 middle = c[0] + s * (c[1] - c[0]) + t * (1 - s) * (c[2] - c[0]);
      for (uint32_t e = 0; e < 3; ++e) {
        FacePart& part = e ? parts.emplace_back(whole) : parts[at];
        part.corner[e] = middle;
      }
    } else {  // into two
      const Vec2 on_edge = c[k] + s * (c[(k + 1) % 3] - c[k]);
      parts[at].corner[k] = on_edge;
      parts.emplace_back(whole).corner[(k + 1) % 3] = on_edge;
    }
  }
  std::shuffle(parts.begin(), parts.end(), random);
  return parts;
}

struct Found {
  uint32_t face = 0;
  double b1 = 0, b2 = 0;
  bool inside = false;
};

// The first part that contains the point, or else the one it is closest to.
Found look_at_all(const std::vector<FacePart>& parts, uint32_t triangle, double b1, double b2) {
  Found found;
  double most = -std::numeric_limits<double>::infinity();
  for (uint32_t f = 0; f < parts.size(); ++f) {
    if (parts[f].triangle != triangle) continue;
    const DVec2 a(parts[f].corner[0]), e1 = DVec2(parts[f].corner[1]) - a, e2 = DVec2(parts[f].corner[2]) - a;
    const DVec2 q = DVec2(b1, b2) - a;
    const double det = e1.x * e2.y - e1.y * e2.x;
    if (det == 0) continue;
    const double c1 = (q.x * e2.y - q.y * e2.x) / det, c2 = (e1.x * q.y - e1.y * q.x) / det;
    const double least = std::min({c1, c2, 1 - c1 - c2});
    if (least >= 0) return {f, c1, c2, true};
    if (least * std::sqrt(std::abs(det)) > most) {
      most = least * std::sqrt(std::abs(det));
      found = {f, c1, c2, false};
    }
  }
  return found;
}

void expect_same(const std::vector<FacePart>& parts, uint32_t triangle, const std::vector<DVec2>& points) {
  const Atlas atlas = atlas_of(parts);
  const AtlasLookup lookup(atlas);
  size_t others = 0, inside = 0;
  for (const DVec2& p : points) {
    const Found found = look_at_all(parts, triangle, p.x, p.y);
    double b1 = p.x, b2 = p.y;
    const uint32_t face = lookup.face_at(0, triangle, b1, b2);
    others += face != found.face || b1 != found.b1 || b2 != found.b2;
    inside += found.inside;
  }
  EXPECT_EQ(others, 0u) << "of " << points.size();
  EXPECT_GT(inside, points.size() / 2);
}

// In the triangle, at corners and on edges of its parts, where several may hold a point, and just outside.
std::vector<DVec2> points_of(const std::vector<FacePart>& parts, uint32_t triangle, std::mt19937& random) {
  std::vector<DVec2> points;
  std::uniform_real_distribution<double> unit;
  for (int i = 0; i < 4000; ++i) {
    const double a = unit(random), b = unit(random);
    points.push_back(a + b < 1 ? DVec2(a, b) : DVec2(1 - a, 1 - b));
  }
  for (const FacePart& part : parts) {
    if (part.triangle != triangle) continue;
    for (uint32_t k = 0; k < 3; ++k) {
      const DVec2 c(part.corner[k]), next(part.corner[(k + 1) % 3]);
      points.push_back(c);
      points.push_back(c + unit(random) * (next - c));
      points.push_back(c + 1e-7 * (DVec2(unit(random), unit(random)) - 0.5));
    }
  }
  return points;
}

TEST(AtlasLookup, PartsAreFoundAsByLookingAtAll) {
  std::mt19937 random(7);
  for (const size_t count : {1, 5, 6, 40, 1500}) {
    std::vector<FacePart> parts = split(2, count, random);
    const std::vector<FacePart> others = split(0, 30, random);  // of another triangle, in between
    parts.insert(parts.begin() + static_cast<ptrdiff_t>(parts.size() / 2), others.begin(), others.end());
    SCOPED_TRACE(count);
    expect_same(parts, 2, points_of(parts, 2, random));
    expect_same(parts, 0, points_of(parts, 0, random));
  }
}

// Strips side by side, which lie in many cells each, and a fan, all of whose parts meet in one point.
TEST(AtlasLookup, LongPartsAreFoundToo) {
  std::mt19937 random(8);
  constexpr uint32_t kCount = 600;
  std::vector<FacePart> strips, fan;
  for (uint32_t i = 0; i < kCount; ++i) {
    const float from = static_cast<float>(i) / kCount, to = static_cast<float>(i + 1) / kCount;
    strips.push_back({0, {{from, 0}, {to, 0}, {from, 1 - from}}});
    strips.push_back({0, {{to, 0}, {to, 1 - to}, {from, 1 - from}}});
    fan.push_back({0, {{0, 0}, {1 - from, from}, {1 - to, to}}});
  }
  expect_same(strips, 0, points_of(strips, 0, random));
  expect_same(fan, 0, points_of(fan, 0, random));
}

// Where parts leave a gap or have no area, a point still has a face.
TEST(AtlasLookup, PointsInGapsAreFoundBeside) {
  std::mt19937 random(9);
  std::vector<FacePart> parts = split(0, 40, random);
  parts.resize(30);
  std::vector<DVec2> points = points_of(parts, 0, random);
  expect_same(parts, 0, points);
  const std::vector<FacePart> flat(8, FacePart{0, {{0, 0}, {0.5f, 0.5f}, {1, 1}}});
  const Atlas atlas = atlas_of(flat);
  double b1 = 0.2, b2 = 0.3;
  EXPECT_EQ(AtlasLookup(atlas).face_at(0, 0, b1, b2), 0u);
  EXPECT_EQ(b1, 0);
  EXPECT_EQ(b2, 0);
}

}  // namespace
}  // namespace kiln
