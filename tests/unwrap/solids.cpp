#include "tests/unwrap/solids.h"

#include <functional>
#include <map>

namespace kiln::test {
namespace {

constexpr double kTau = 6.283185307179586;

// A grid of (columns + 1) x (rows + 1) points with normals from its triangles, summed at equal positions.
Mesh grid(const char* name, uint32_t columns, uint32_t rows, const std::function<DVec3(double, double)>& at) {
  Mesh m;
  m.name = name;
  for (uint32_t y = 0; y <= rows; ++y)
    for (uint32_t x = 0; x <= columns; ++x)
      m.positions.push_back(Vec3(at(double(x) / columns, double(y) / rows)));
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < columns; ++x) {
      const uint32_t i = y * (columns + 1) + x, j = i + columns + 1;
      for (const UVec3& t : {UVec3(i, i + 1, j + 1), UVec3(i, j + 1, j)})
        if (m.positions[t.x] != m.positions[t.y] && m.positions[t.y] != m.positions[t.z] &&
            m.positions[t.z] != m.positions[t.x])
          m.triangles.push_back(t);
    }
  std::map<std::array<float, 3>, Vec3> sums;
  const auto key = [&](uint32_t v) {
    return std::array{m.positions[v].x, m.positions[v].y, m.positions[v].z};
  };
  for (const UVec3& t : m.triangles)
    for (int k = 0; k < 3; ++k)
      sums[key(t[k])] += cross(m.positions[t.y] - m.positions[t.x], m.positions[t.z] - m.positions[t.x]);
  for (uint32_t v = 0; v < m.positions.size(); ++v)
    m.normals.push_back(normalize_or(sums[key(v)], Vec3(0, 1, 0)));
  return m;
}

// Corner angles are taken modulo one turn, so that the ends of a closed grid are equal to the bit.
double turn(double t) {
  return t >= 1 ? 0.0 : t * kTau;
}

void append(Mesh& to, const Mesh& from, const Vec3& offset) {
  const auto first = static_cast<uint32_t>(to.positions.size());
  for (const Vec3& p : from.positions) to.positions.push_back(p + offset);
  to.normals.insert(to.normals.end(), from.normals.begin(), from.normals.end());
  for (const UVec3& t : from.triangles) to.triangles.push_back(t + first);
}

void flat_quad(Mesh& m, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto first = static_cast<uint32_t>(m.positions.size());
  const Vec3 n = normalize_or(cross(b - a, c - a), Vec3(0, 1, 0));
  for (const Vec3& p : {a, b, c, d}) m.positions.push_back(p), m.normals.push_back(n);
  m.triangles.push_back({first, first + 1, first + 2});
  m.triangles.push_back({first, first + 2, first + 3});
}

void cell(Mesh& m, const Vec3& o, const std::function<bool(int, int)>& filled, int x, int y) {
  const Vec3 dx(1, 0, 0), dy(0, 1, 0), dz(0, 0, 1);
  flat_quad(m, o + dz, o + dz + dx, o + dz + dx + dy, o + dz + dy);
  flat_quad(m, o, o + dy, o + dx + dy, o + dx);
  if (!filled(x - 1, y)) flat_quad(m, o, o + dz, o + dz + dy, o + dy);
  if (!filled(x + 1, y)) flat_quad(m, o + dx, o + dx + dy, o + dx + dy + dz, o + dx + dz);
  if (!filled(x, y - 1)) flat_quad(m, o, o + dx, o + dx + dz, o + dz);
  if (!filled(x, y + 1)) flat_quad(m, o + dy, o + dy + dz, o + dy + dx + dz, o + dy + dx);
}

}  // namespace

Mesh torus(uint32_t n, float major, float minor) {
  return grid("torus", 2 * n, n, [&](double u, double v) {
    const double a = -turn(u), b = turn(v), r = major + minor * std::cos(b);
    return DVec3(r * std::cos(a), minor * std::sin(b), r * std::sin(a));
  });
}

Mesh blob(uint32_t n) {
  return grid("blob", 2 * n, n, [&](double u, double v) {
    const double phi = turn(u), ring = v <= 0 || v >= 1 ? 0.0 : std::sin(kTau / 2 * v);
    const DVec3 d(ring * std::cos(phi), std::cos(kTau / 2 * v), ring * std::sin(phi));
    const double bumps = 0.12 * std::sin(5 * d.x + 1) * std::sin(6 * d.y) +
                         0.06 * std::sin(11 * d.z + 3 * d.x) +
                         0.02 * std::sin(31 * d.y) * std::sin(29 * d.x + 2);
    return (1 + bumps) * d;
  });
}

Mesh terrain(uint32_t n) {
  return grid("terrain", n, n, [](double u, double v) {
    const double hills =
        6 * std::sin(3 * u + 1) * std::sin(4 * v) + 1.5 * std::sin(17 * u) * std::sin(13 * v + u);
    return DVec3(100 * v, hills + 8 * std::max(0.0, 1 - 12 * std::abs(u - 0.5 - 0.1 * std::sin(6 * v))),
                 100 * u);
  });
}

Mesh tube(uint32_t n, uint32_t rows) {
  return grid("tube", n, rows, [](double u, double v) {
    const double a = -turn(u);
    return DVec3(std::cos(a), 3 * v, std::sin(a));
  });
}

Mesh tree_of_cones(uint32_t levels) {
  Mesh m;
  m.name = "tree of cones";
  for (uint32_t k = 0; k < levels; ++k) {
    const double size = 1.0 - 0.8 * k / levels;
    append(m,
           grid("", 24, 4,
                [&](double u, double v) {
                  const double a = -turn(u), r = v >= 1 ? 0.0 : size * (1 - v);
                  return DVec3(r * std::cos(a), 1.5 * v, r * std::sin(a));
                }),
           Vec3(0, 0.9f * static_cast<float>(k), 0));
  }
  return m;
}

Mesh letters(uint32_t count) {
  static const char* const kRows[3][5] = {{"###", "#.#", "###", "#.#", "###"},
                                          {"#.#", "##.", "#..", "##.", "#.#"},
                                          {"###", "#..", "##.", "#..", "###"}};
  Mesh m;
  m.name = "letters";
  for (uint32_t c = 0; c < count; ++c) {
    const auto filled = [&](int x, int y) {
      return x >= 0 && x < 3 && y >= 0 && y < 5 && kRows[c % 3][4 - y][x] == '#';
    };
    for (int y = 0; y < 5; ++y)
      for (int x = 0; x < 3; ++x)
        if (filled(x, y))
          cell(m, Vec3(4.0f * static_cast<float>(c) + static_cast<float>(x), y, 0), filled, x, y);
  }
  return m;
}

Mesh moebius(uint32_t n) {
  Mesh m = grid("moebius", n, 4, [&](double u, double v) {
    const double a = kTau * u, w = v - 0.5, r = 2 + w * std::cos(a / 2);
    return DVec3(r * std::cos(a), w * std::sin(a / 2), r * std::sin(a));
  });
  for (uint32_t y = 0; y <= 4; ++y) m.positions[y * (n + 1) + n] = m.positions[(4 - y) * (n + 1)];
  return m;
}

Mesh klein(uint32_t n) {  // the figure-8 immersion
  return grid("klein", 2 * n, n, [](double u, double v) {
    const double a = kTau * u, b = kTau * v;
    const double r = 2 + std::cos(a / 2) * std::sin(b) - std::sin(a / 2) * std::sin(2 * b);
    return DVec3(r * std::cos(a), std::sin(a / 2) * std::sin(b) + std::cos(a / 2) * std::sin(2 * b),
                 r * std::sin(a));
  });
}

Mesh fan(uint32_t blades) {
  Mesh m;
  m.name = "fan";
  m.positions = {{0, 0, 0}, {0, 1, 0}};
  m.normals = {{0, 1, 0}, {0, 1, 0}};
  for (uint32_t k = 0; k < blades; ++k) {
    const double a = kTau * k / blades;
    m.positions.push_back(Vec3(DVec3(std::cos(a), 0.5, std::sin(a))));
    m.normals.push_back({0, 1, 0});
    m.triangles.push_back(k % 3 ? UVec3(0, 1, k + 2) : UVec3(1, 0, k + 2));
  }
  return m;
}

Mesh with_noise(Mesh mesh, float size, uint64_t seed) {
  Random random(seed);
  std::map<std::array<float, 3>, Vec3> moved;
  for (Vec3& p : mesh.positions) {
    const auto [it, fresh] = moved.try_emplace({p.x, p.y, p.z});
    if (fresh)
      it->second = p + size * Vec3(DVec3(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5));
    p = it->second;
  }
  return mesh;
}

}  // namespace kiln::test
