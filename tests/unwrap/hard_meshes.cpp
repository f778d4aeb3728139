#include "tests/unwrap/hard_meshes.h"

#include <array>
#include <functional>
#include <unordered_map>

namespace kiln::test {
namespace {

constexpr double kTau = 6.283185307179586;

double lattice(int64_t x, int64_t y, int64_t z) {
  uint64_t h = static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15u ^
               static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^
               static_cast<uint64_t>(z) * 0x165667b19e3779f9u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  return static_cast<double>(h >> 11) * 0x1p-52 - 1;
}

// Value noise in [-1, 1], smooth to the second derivative.
double noise(const DVec3& p) {
  int64_t cell[3];
  double t[3];
  for (int k = 0; k < 3; ++k) {
    const double low = std::floor(p[k]), f = p[k] - low;
    cell[k] = static_cast<int64_t>(low);
    t[k] = f * f * f * (f * (6 * f - 15) + 10);
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    double w = 1;
    for (int k = 0; k < 3; ++k) w *= c >> k & 1 ? t[k] : 1 - t[k];
    sum += w * lattice(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2));
  }
  return sum;
}

double octaves(const DVec3& p, int count, double gain) {
  double sum = 0, size = 1, scale = 1;
  for (int k = 0; k < count; ++k, size *= gain, scale *= 2) sum += size * noise(scale * p + DVec3(17.0 * k));
  return sum;
}

void add_normals(Mesh& m) {
  m.normals.assign(m.positions.size(), Vec3(0.0f));
  for (const UVec3& t : m.triangles) {
    const Vec3 n = cross(m.positions[t.y] - m.positions[t.x], m.positions[t.z] - m.positions[t.x]);
    for (int k = 0; k < 3; ++k) m.normals[t[k]] += n;
  }
  for (Vec3& n : m.normals) n = normalize_or(n, Vec3(0, 1, 0));
}

using Surface2 = std::function<DVec3(double, double)>;

// A smooth patch with vertices of its own.
void add_patch(Mesh& m, uint32_t columns, uint32_t rows, const Surface2& at) {
  Mesh patch;
  for (uint32_t y = 0; y <= rows; ++y)
    for (uint32_t x = 0; x <= columns; ++x)
      patch.positions.push_back(Vec3(at(double(x) / columns, double(y) / rows)));
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < columns; ++x) {
      const uint32_t i = y * (columns + 1) + x, j = i + columns + 1;
      patch.triangles.push_back({i, i + 1, j + 1});
      patch.triangles.push_back({i, j + 1, j});
    }
  add_normals(patch);
  const auto first = static_cast<uint32_t>(m.positions.size());
  m.positions.insert(m.positions.end(), patch.positions.begin(), patch.positions.end());
  m.normals.insert(m.normals.end(), patch.normals.begin(), patch.normals.end());
  for (const UVec3& t : patch.triangles) m.triangles.push_back(t + first);
}

// A patch whose four borders are turned inwards by `depth`, each a strip behind a crease.
void add_panel(Mesh& m, uint32_t n, double depth, const Surface2& at) {
  add_patch(m, n, n, at);
  const auto inward = [&](double u, double v) {
    const double e = 1e-3, cu = std::clamp(u, e, 1 - e), cv = std::clamp(v, e, 1 - e);
    const DVec3 c = cross(at(cu + e, cv) - at(cu - e, cv), at(cu, cv + e) - at(cu, cv - e));
    return at(u, v) - depth / length(c) * c;
  };
  const auto strip = [&](const std::function<DVec2(double)>& border) {
    add_patch(m, n, 1, [&](double s, double t) {
      const DVec2 p = border(s);
      return t > 0 ? at(p.x, p.y) : inward(p.x, p.y);
    });
  };
  strip([](double s) { return DVec2(s, 0); });
  strip([](double s) { return DVec2(1, s); });
  strip([](double s) { return DVec2(1 - s, 1); });
  strip([](double s) { return DVec2(0, 1 - s); });
}

// The body: a flattened superellipsoid, 4.4 m long.
DVec3 body(double u, double v) {
  const double a = kTau * u, b = kTau / 4 * (1.9 * v - 0.9);
  const auto power = [](double x) { return std::copysign(std::pow(std::abs(x), 0.8), x); };
  return {2.2 * power(std::cos(b)) * power(std::sin(a)), 0.7 + 0.6 * power(std::sin(b)),
          0.9 * power(std::cos(b)) * power(std::cos(a))};
}

void add_quad(Mesh& m, const DVec3& a, const DVec3& b, const DVec3& c, const DVec3& d) {
  add_patch(m, 1, 1, [&](double u, double v) { return v == 0 ? (u == 0 ? a : b) : (u == 0 ? d : c); });
}

// Six sides, a chamfer and a top, every face flat.
void add_bolt(Mesh& m, const DVec3& at, const DVec3& axis, double radius) {
  const DVec3 x = cross(axis, std::abs(axis.y) < 0.9 ? DVec3(0, 1, 0) : DVec3(1, 0, 0));
  const DVec3 u = x / length(x), v = cross(axis, u);
  const auto ring = [&](int k, double r, double h) {
    const double a = kTau * (k % 6) / 6;
    return at + r * radius * (std::cos(a) * u + std::sin(a) * v) + h * radius * axis;
  };
  for (int k = 0; k < 6; ++k) {
    add_quad(m, ring(k, 1, 0), ring(k + 1, 1, 0), ring(k + 1, 1, 0.7), ring(k, 1, 0.7));
    add_quad(m, ring(k, 1, 0.7), ring(k + 1, 1, 0.7), ring(k + 1, 0.8, 0.9), ring(k, 0.8, 0.9));
  }
  const auto first = static_cast<uint32_t>(m.positions.size());
  for (int k = 0; k < 6; ++k) {
    m.positions.push_back(Vec3(ring(k, 0.8, 0.9)));
    m.normals.push_back(Vec3(axis));
  }
  for (uint32_t k = 1; k < 5; ++k) m.triangles.push_back({first, first + k, first + k + 1});
}

void add_slat(Mesh& m, const DVec3& at, const DVec3& size) {
  const Mesh b = box(Vec3(size), Uv::kNone);
  const auto first = static_cast<uint32_t>(m.positions.size());
  for (const Vec3& p : b.positions) m.positions.push_back(p + Vec3(at));
  m.normals.insert(m.normals.end(), b.normals.begin(), b.normals.end());
  for (const UVec3& t : b.triangles) m.triangles.push_back(t + first);
}

double cave_distance(const DVec3& p) {
  const auto tube = [&](const DVec3& a, const DVec3& b, double radius) {
    const DVec3 d = b - a;
    const double t = std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0);
    const DVec3 bend(0, 1.2 * std::sin(5 * t), 1.5 * std::sin(4 * t + 1) - 1.26);
    return radius - length(p - a - t * d - bend);
  };
  return std::max(tube({3, 6, 7}, {37, 5, 9}, 2.2), tube({18, 6, 8}, {28, 7, 19}, 1.7)) +
         0.45 * octaves(0.7 * p, 4, 0.55);
}

}  // namespace

Mesh height_field(uint32_t n) {
  Mesh m;
  m.name = "height field";
  add_patch(m, n, n, [](double u, double v) {
    return DVec3(100 * v, 12.5 * octaves({5 * u, 0.5, 5 * v}, 5, 0.45), 100 * u);
  });
  return m;
}

Mesh vehicle(uint32_t bolts) {
  Mesh m;
  m.name = "vehicle";
  constexpr int kAround = 16, kUp = 5;
  for (int y = 0; y < kUp; ++y)
    for (int x = 0; x < kAround; ++x)
      add_panel(m, 10, 0.02, [=](double u, double v) {
        return body((x + 0.01 + 0.98 * u) / kAround, (y + 0.02 + 0.96 * v) / kUp);
      });
  for (int k = 0; k < 4; ++k) {
    const DVec3 hub(k % 2 ? 1.4 : -1.4, 0.35, k / 2 ? 0.8 : -0.8);
    const auto ring = [=](double r, double a, double b) {
      return hub + DVec3((0.3 + r * std::cos(b)) * std::cos(a), (0.3 + r * std::cos(b)) * std::sin(a),
                         r * std::sin(b));
    };
    add_patch(m, 40, 14, [=](double u, double v) { return ring(0.09, -kTau * u, kTau * v); });
    add_panel(m, 12, 0.015,
              [=](double u, double v) { return ring(0.14, kTau / 2 * (1 - u), 2.4 * v - 1.2); });
    for (int s = 0; s < 8; ++s) add_slat(m, hub + DVec3(0.02, 0.05 * s - 0.2, 0), {0.3, 0.012, 0.03});
  }
  for (int s = 0; s < 40; ++s) add_slat(m, {-2.3, 0.3 + 0.012 * s, -0.5}, {0.05, 0.004, 1.0});
  Random random(3);
  for (uint32_t k = 0; k < bolts; ++k) {
    const double u = random.next(), v = 0.1 + 0.8 * random.next(), e = 1e-4;
    const DVec3 n = cross(body(u + e, v) - body(u - e, v), body(u, v + e) - body(u, v - e));
    add_bolt(m, body(u, v), n / length(n), 0.006 + 0.012 * random.next());
  }
  return m;
}

Mesh cave(uint32_t cells) {
  Mesh m;
  m.name = "cave";
  const double step = 40.0 / cells;
  const std::array<uint32_t, 3> size = {cells + 1, cells * 12 / 40 + 1, cells * 24 / 40 + 1};
  const auto index = [&](uint32_t x, uint32_t y, uint32_t z) { return (z * size[1] + y) * size[0] + x; };
  const auto point = [&](uint32_t i) {
    return step * DVec3(i % size[0], i / size[0] % size[1], i / size[0] / size[1]);
  };
  std::vector<double> value(size_t{size[0]} * size[1] * size[2]);
  for (uint32_t i = 0; i < value.size(); ++i) value[i] = cave_distance(point(i));
  std::unordered_map<uint64_t, uint32_t> vertices;
  const auto vertex = [&](uint32_t a, uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [it, made] = vertices.try_emplace(uint64_t{a} << 32 | b, m.positions.size());
    if (made) {
      const double t = std::clamp(value[a] / (value[a] - value[b]), 0.02, 0.98);
      m.positions.push_back(Vec3(point(a) + t * (point(b) - point(a))));
    }
    return it->second;
  };
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c, const DVec3& inside) {  // front towards the inside
    const DVec3 pa(m.positions[a]), n = cross(DVec3(m.positions[b]) - pa, DVec3(m.positions[c]) - pa);
    m.triangles.push_back(dot(n, inside - pa) > 0 ? UVec3(a, b, c) : UVec3(a, c, b));
  };
  const auto tetrahedron = [&](const std::array<uint32_t, 4>& corner) {
    std::vector<uint32_t> in, out;
    for (uint32_t i : corner) (value[i] > 0 ? in : out).push_back(i);
    if (in.empty() || out.empty()) return;
    DVec3 middle(0.0);
    for (uint32_t i : in) middle += point(i) / static_cast<double>(in.size());
    if (in.size() == 2) {
      const uint32_t a = vertex(in[0], out[0]), b = vertex(in[0], out[1]), c = vertex(in[1], out[1]),
                     d = vertex(in[1], out[0]);
      add(a, b, c, middle);
      add(a, c, d, middle);
    } else {
      const std::vector<uint32_t>& lone = in.size() == 1 ? in : out;
      const std::vector<uint32_t>& rest = in.size() == 1 ? out : in;
      add(vertex(lone[0], rest[0]), vertex(lone[0], rest[1]), vertex(lone[0], rest[2]), middle);
    }
  };
  constexpr int kAxes[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (uint32_t z = 0; z + 1 < size[2]; ++z)
    for (uint32_t y = 0; y + 1 < size[1]; ++y)
      for (uint32_t x = 0; x + 1 < size[0]; ++x)
        for (const auto& axes : kAxes) {  // six tetrahedra along the diagonal (Kuhn)
          uint32_t at[3] = {x, y, z};
          std::array<uint32_t, 4> corner;
          for (size_t k = 0; k < 4; ++k) {
            corner[k] = index(at[0], at[1], at[2]);
            if (k < 3) ++at[axes[k]];
          }
          tetrahedron(corner);
        }
  add_normals(m);
  return m;
}

}  // namespace kiln::test
