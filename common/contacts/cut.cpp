// Splits each triangle by the lines of its contacts into convex polygons. A line splits every polygon that
// its contact enters completely, so polygons stay convex and contacts that do not quite touch still close.
// Then polygons are joined to charts again across every side without a contact, but never two that share a
// contact anywhere: the two sides of a wall that ends in the middle of a floor become two charts.
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <unordered_map>

#include "common/base/check.h"
#include "common/contacts/contacts.h"
#include "common/contacts/cut_polygon.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

using namespace cut;

constexpr double kMinChart = 8;  // texels: smaller ones are not cut
class Cutter {
 public:
  Cutter(const Mesh& mesh, const Mat4x3& to_world, const MeshCharts& base, std::span<const Contact> contacts,
         double texel, const std::function<bool(uint32_t, const DVec2&)>& is_buried)
      : mesh_(mesh),
        to_world_(to_world),
        base_(base),
        contacts_(contacts),
        texel_(texel),
        is_buried_(is_buried),
        weld_(weld_corners(mesh, {})) {
    KILN_CHECK(base.parts.empty());
    for (uint32_t w : weld_) points_ = std::max(points_, w + 1);
  }

  MeshCharts cut(size_t& refused) {
    if (!divide(refused)) return {};
    join();
    return faces();
  }

  // Charts divided by a contact.
  std::vector<bool> divided(size_t& refused) {
    std::vector<bool> charts(base_.chart_count);
    if (!divide(refused)) return charts;
    for (size_t i = 0; i < apart_.size(); ++i)
      if (!apart_[i].empty()) charts[base_.chart_of_face[all_[i]->triangle]] = true;
    return charts;
  }

 private:
  Flat flatten(uint32_t triangle) const {
    const UVec3& v = mesh_.triangles[triangle];
    const DVec3 e1(transform_vector(to_world_, mesh_.positions[v.y] - mesh_.positions[v.x]));
    const DVec3 e2(transform_vector(to_world_, mesh_.positions[v.z] - mesh_.positions[v.x]));
    const double along = length(e1);
    Flat flat;
    flat.corner[1] = DVec2(along, 0);
    const double x = along > 0 ? dot(e2, e1) / along : 0.0;
    flat.corner[2] = DVec2(x, std::sqrt(std::max(0.0, dot(e2, e2) - x * x)));
    return flat;
  }

  uint32_t id_of(const PointKey& key) {
    const auto [it, made] = ids_.try_emplace(key, points_);
    points_ += made;
    return it->second;
  }

  // The point of a triangle's side `k` at `t` from the corner with the smaller weld.
  Point side_point(const Flat& flat, uint32_t triangle, int k, double t) {
    const uint32_t from = weld_[3 * triangle + k], to = weld_[3 * triangle + (k + 1) % 3];
    Point p;
    p.id =
        id_of({uint64_t{std::min(from, to)} << 32 | std::max(from, to), static_cast<uint64_t>(t * kGrid), 0});
    const double forward = from < to ? t : 1 - t;
    p.bary = k == 0 ? DVec2(forward, 0) : k == 1 ? DVec2(1 - forward, forward) : DVec2(0, 1 - forward);
    p.at = flat.at(p.bary);
    return p;
  }
  // The nearest point that either triangle has already put on the side, or `t` itself: the two sides must not
  // differ by rounding.
  double snapped(const Flat& flat, uint32_t triangle, int k, double t) {
    std::vector<double>& known = on_side_[side_key(triangle, k)];
    const double near = 4 * least() / length(flat.corner[(k + 1) % 3] - flat.corner[k]);
    for (const double at : known)
      if (std::abs(at - t) <= near) return at;
    known.push_back(on_grid(t));
    return known.back();
  }
  // Parameter along side k of a point with these barycentrics, from the corner with the smaller weld.
  double along_side(uint32_t triangle, int k, const DVec2& b) const {
    const double forward = k == 0 ? b.x : k == 1 ? b.y : 1 - b.y;
    return weld_[3 * triangle + k] < weld_[3 * triangle + (k + 1) % 3] ? forward : 1 - forward;
  }

  Polygon whole(uint32_t triangle, const Flat& flat) const {
    Polygon p{triangle, {}, {0, 1, 2}};
    for (int k = 0; k < 3; ++k)
      p.points.push_back({flat.corner[k], DVec2(k == 1, k == 2), weld_[3 * triangle + k]});
    return p;
  }

  // Where the side of `p` from point k crosses the line, at share t.
  Point crossing(const Polygon& p, const Flat& flat, size_t k, double t) {
    const Point &a = p.points[k], &b = p.points[(k + 1) % p.points.size()];
    DVec2 bary = a.bary + t * (b.bary - a.bary);
    if (p.side[k] >= 0) {
      const int side = p.side[k];
      return side_point(flat, p.triangle, side,
                        snapped(flat, p.triangle, side, along_side(p.triangle, side, bary)));
    }
    bary = DVec2(on_grid(bary.x), on_grid(bary.y));
    if (bary.x + bary.y > 1) bary.y = 1 - bary.x;
    Point point;
    point.bary = bary;
    point.at = flat.at(bary);
    point.id = id_of({uint64_t{p.triangle}, static_cast<uint64_t>(bary.x * kGrid),
                      uint64_t{1} << 32 | static_cast<uint64_t>(bary.y * kGrid)});
    return point;
  }

  // Splits `p` by the line through a with unit direction d if the contact, which ends at `length`, enters it.
  bool part(const Polygon& p, const Flat& flat, const DVec2& a, const DVec2& d, double length,
            std::vector<Polygon>& out) {
    const double eps = least();
    std::vector<double> height(p.points.size());
    double most = 0, least_height = 0;
    for (size_t k = 0; k < p.points.size(); ++k) {
      const DVec2 q = p.points[k].at - a;
      height[k] = d.x * q.y - d.y * q.x;
      if (std::abs(height[k]) <= eps) height[k] = 0;
      most = std::max(most, height[k]);
      least_height = std::min(least_height, height[k]);
    }
    if (most == 0 || least_height == 0) return false;
    double enter = 1e300, leave = -1e300;
    const auto note = [&](const DVec2& q) {
      enter = std::min(enter, dot(q - a, d));
      leave = std::max(leave, dot(q - a, d));
    };
    Polygon above{p.triangle, {}, {}}, below = above;
    for (size_t k = 0; k < p.points.size(); ++k) {
      const size_t m = (k + 1) % p.points.size();
      if (height[k] >= 0) above.points.push_back(p.points[k]), above.side.push_back(p.side[k]);
      if (height[k] <= 0) below.points.push_back(p.points[k]), below.side.push_back(p.side[k]);
      if (height[k] == 0) {  // the half that the next point is not in ends here
        note(p.points[k].at);
        if (height[m] < 0) above.side.back() = -1;
        if (height[m] > 0) below.side.back() = -1;
      }
      if (height[k] * height[m] < 0) {
        const Point c = crossing(p, flat, k, height[k] / (height[k] - height[m]));
        note(c.at);
        above.points.push_back(c);
        below.points.push_back(c);
        above.side.push_back(height[m] > 0 ? p.side[k] : -1);
        below.side.push_back(height[m] < 0 ? p.side[k] : -1);
      }
    }
    if (std::min(leave, length) - std::max(enter, 0.0) <= eps) return false;
    if (above.points.size() < 3 || below.points.size() < 3) return false;
    out.push_back(std::move(above));
    out.push_back(std::move(below));
    return true;
  }

  void part_triangles(size_t& refused) {
    polygons_of_.assign(mesh_.triangles.size(), {});
    for (size_t i = 0, end; i < contacts_.size(); i = end) {
      const uint32_t triangle = contacts_[i].triangle;
      for (end = i; end < contacts_.size() && contacts_[end].triangle == triangle;) ++end;
      const Flat flat = flatten(triangle);
      std::vector<std::pair<DVec2, DVec2>> lines;
      for (size_t c = i; c < end; ++c) lines.push_back({flat.at(contacts_[c].a), flat.at(contacts_[c].b)});
      std::sort(
          lines.begin(), lines.end(), [](const auto& p, const auto& q) {  // long ones first: fewer parts
            const double lp = length(p.second - p.first), lq = length(q.second - q.first);
            return lp != lq ? lp > lq : std::array{p.first.x, p.first.y} < std::array{q.first.x, q.first.y};
          });
      std::vector<Polygon> parts{whole(triangle, flat)};
      for (const auto& [a, b] : lines) {
        const double size = length(b - a);
        std::vector<Polygon> next;
        for (Polygon& p : parts)
          if (!part(p, flat, a, (b - a) / size, size, next)) next.push_back(std::move(p));
        parts = std::move(next);
        if (parts.size() > kMaxParts) break;
      }
      if (parts.size() > kMaxParts) {
        ++refused;
        continue;
      }
      polygons_of_[triangle] = std::move(parts);
    }
  }

  // Barycentrics are exact on the sides of the triangle.
  static bool is_on_side(int side, const DVec2& b) {
    return side == 0 ? b.y == 0 : side == 1 ? b.x + b.y == 1 : b.x == 0;
  }

  // Inserts points that lie on a side of a polygon, between its ends, into the polygon.
  void insert_points(Polygon& p, const std::vector<Point>& candidates) const {
    const double eps = 2 * least();
    DVec2 low(1e300), high(-1e300);
    for (const Point& q : p.points) low = glm::min(low, q.at), high = glm::max(high, q.at);
    std::vector<const Point*> near;
    for (const Point& c : candidates)
      if (c.at.x >= low.x - eps && c.at.y >= low.y - eps && c.at.x <= high.x + eps && c.at.y <= high.y + eps)
        near.push_back(&c);
    if (near.size() <= p.points.size() && std::all_of(near.begin(), near.end(), [&](const Point* c) {
          return std::any_of(p.points.begin(), p.points.end(), [&](const Point& q) { return q.id == c->id; });
        }))
      return;
    Polygon out{p.triangle, {}, {}};
    for (size_t k = 0; k < p.points.size(); ++k) {
      const Point &a = p.points[k], &b = p.points[(k + 1) % p.points.size()];
      out.points.push_back(a);
      out.side.push_back(p.side[k]);
      const DVec2 d = b.at - a.at;
      const double size = length(d);
      std::vector<std::pair<double, const Point*>> between;
      for (const Point* c : near) {
        if (c->id == a.id || c->id == b.id) continue;
        // The triangle's own sides stay straight, to match the next triangle: a point merely near a side is
        // not on it.
        if (p.side[k] >= 0 && !is_on_side(p.side[k], c->bary)) continue;
        const DVec2 q = c->at - a.at;
        const double t = dot(q, d) / size;
        if (t > 0 && t < size && std::abs(d.x * q.y - d.y * q.x) <= eps * size) between.push_back({t, c});
      }
      std::sort(between.begin(), between.end(), [](const auto& x, const auto& y) {
        return x.first != y.first ? x.first < y.first : x.second->id < y.second->id;
      });
      for (const auto& [t, c] : between) {
        if (c->id == out.points.back().id) continue;
        out.points.push_back(*c);
        out.side.push_back(p.side[k]);
      }
    }
    p = std::move(out);
  }

  static std::vector<Point> points_of(const std::vector<Polygon>& polygons) {
    std::vector<Point> all;
    for (const Polygon& p : polygons) all.insert(all.end(), p.points.begin(), p.points.end());
    std::sort(all.begin(), all.end(), [](const Point& a, const Point& b) { return a.id < b.id; });
    all.erase(
        std::unique(all.begin(), all.end(), [](const Point& a, const Point& b) { return a.id == b.id; }),
        all.end());
    return all;
  }

  // Sides covered by a contact over a large part of their length.
  void mark_sides() {
    for (size_t i = 0, end; i < contacts_.size(); i = end) {
      const uint32_t triangle = contacts_[i].triangle;
      for (end = i; end < contacts_.size() && contacts_[end].triangle == triangle;) ++end;
      std::vector<Polygon>& polygons = polygons_of_[triangle];
      if (polygons.empty()) continue;
      const std::vector<Point> all = points_of(polygons);
      for (Polygon& p : polygons) insert_points(p, all);
      const Flat flat = flatten(triangle);
      std::vector<std::pair<DVec2, DVec2>> lines;
      for (size_t c = i; c < end; ++c) lines.push_back({flat.at(contacts_[c].a), flat.at(contacts_[c].b)});
      for (const Polygon& p : polygons)
        for (size_t k = 0; k < p.points.size(); ++k) {
          const Point &a = p.points[k], &b = p.points[(k + 1) % p.points.size()];
          double covered = 0;
          for (const auto& [from, to] : lines) covered += shared(a.at, b.at, from, to);
          if (covered > std::min(0.25 * length(b.at - a.at), 0.25 * texel_))
            walls_.insert(std::minmax(a.id, b.id));
        }
    }
  }
  // Length of the part of a-b on which c-d lies.
  double shared(const DVec2& a, const DVec2& b, const DVec2& c, const DVec2& d) const {
    const double eps = 4 * least();
    for (int axis = 0; axis < 2; ++axis)
      if (std::max(c[axis], d[axis]) < std::min(a[axis], b[axis]) - eps ||
          std::min(c[axis], d[axis]) > std::max(a[axis], b[axis]) + eps)
        return 0;
    const double size = length(b - a);
    if (!(size > 0)) return 0;
    const DVec2 u = (b - a) / size;
    const auto off = [&](const DVec2& q) { return std::abs(u.x * (q.y - a.y) - u.y * (q.x - a.x)); };
    // The contact's line must be that of the side where they overlap, not merely cross it.
    if (off(c) > eps || off(d) > eps) {
      const double lc = length(d - c);
      const DVec2 v = (d - c) / lc;
      const auto off_line = [&](const DVec2& q) { return std::abs(v.x * (q.y - c.y) - v.y * (q.x - c.x)); };
      if (off_line(a) > eps || off_line(b) > eps) return 0;
    }
    const double s = dot(c - a, u), t = dot(d - a, u);
    return std::max(0.0, std::min(std::max(s, t), size) - std::max(std::min(s, t), 0.0));
  }

  // Triangles beside a split side get its points too, so that no gap opens.
  void part_neighbours() {
    for (uint32_t t = 0; t < polygons_of_.size(); ++t) {
      const Flat flat = flatten(t);
      std::vector<Point> extra;
      for (int k = 0; k < 3; ++k)
        if (const auto it = on_side_.find(side_key(t, k)); it != on_side_.end())
          for (const double at : it->second) extra.push_back(side_point(flat, t, k, at));
      if (polygons_of_[t].empty()) polygons_of_[t].push_back(whole(t, flat));
      if (extra.empty()) continue;
      for (Polygon& p : polygons_of_[t]) insert_points(p, extra);
    }
  }
  std::pair<uint32_t, uint32_t> side_key(uint32_t triangle, int k) const {
    return std::minmax(weld_[3 * triangle + k], weld_[3 * triangle + (k + 1) % 3]);
  }

  struct Meeting {
    uint32_t a, b;  // polygons, in order
    double length;
    bool wall;
    DVec2 uv;  // of the middle
  };

  DVec2 uv_of(uint32_t triangle, const DVec2& b) const {
    const DVec2 a(base_.corner_uv[3 * triangle]);
    return a + b.x * (DVec2(base_.corner_uv[3 * triangle + 1]) - a) +
           b.y * (DVec2(base_.corner_uv[3 * triangle + 2]) - a);
  }

  // Splits triangles and finds adjacent polygons. Returns false if nothing stands on any of them.
  bool divide(size_t& refused) {
    part_triangles(refused);
    mark_sides();
    if (walls_.empty()) return false;
    part_neighbours();
    find_meetings();
    return true;
  }

  // Sides that polygons of one base chart share in its plane.
  void find_meetings() {
    for (uint32_t t = 0; t < polygons_of_.size(); ++t)
      for (Polygon& p : polygons_of_[t]) all_.push_back(&p);
    struct Side {
      uint32_t from, to, polygon;
      DVec2 uv_from, uv_to;
      double length;
    };
    std::vector<Side> sides;
    for (uint32_t i = 0; i < all_.size(); ++i) {
      const Polygon& p = *all_[i];
      for (size_t k = 0; k < p.points.size(); ++k) {
        const Point *a = &p.points[k], *b = &p.points[(k + 1) % p.points.size()];
        if (a->id > b->id) std::swap(a, b);
        sides.push_back(
            {a->id, b->id, i, uv_of(p.triangle, a->bary), uv_of(p.triangle, b->bary), length(b->at - a->at)});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::array{a.from, a.to, a.polygon} < std::array{b.from, b.to, b.polygon};
    });
    apart_.resize(all_.size());
    for (size_t i = 0, end; i < sides.size(); i = end) {
      for (end = i; end < sides.size() && sides[end].from == sides[i].from && sides[end].to == sides[i].to;)
        ++end;
      const bool wall = walls_.count({sides[i].from, sides[i].to}) > 0;
      for (size_t x = i; x < end; ++x)
        for (size_t y = x + 1; y < end; ++y) {
          const Side &a = sides[x], &b = sides[y];
          if (base_.chart_of_face[all_[a.polygon]->triangle] !=
              base_.chart_of_face[all_[b.polygon]->triangle])
            continue;
          const double reach = 1e-4 * length(a.uv_to - a.uv_from);
          if (length(a.uv_from - b.uv_from) > reach || length(a.uv_to - b.uv_to) > reach) continue;
          meetings_.push_back({a.polygon, b.polygon, a.length, wall, 0.5 * (a.uv_from + a.uv_to)});
          if (wall) {
            apart_[a.polygon].push_back(b.polygon);
            apart_[b.polygon].push_back(a.polygon);
          }
        }
    }
  }

  // Joins polygons across sides that no contact lies on, the longest first.
  void join() {
    std::vector<Meeting> open;
    for (const Meeting& m : meetings_)  // unless rounding alone separates two copies of one point
      if (!m.wall && m.length > 8 * least()) open.push_back(m);
    std::stable_sort(open.begin(), open.end(),
                     [](const Meeting& a, const Meeting& b) { return a.length > b.length; });
    set_of_.resize(all_.size());
    std::iota(set_of_.begin(), set_of_.end(), 0u);
    members_.resize(all_.size());
    for (uint32_t i = 0; i < all_.size(); ++i) members_[i] = {i};
    for (const Meeting& m : open) merge(set_of_[m.a], set_of_[m.b]);
    give_away();
  }
  // Hidden sets get no texels: their faces shrink to a point beside the neighbour with the longest shared
  // border. Visible sets too small for texels of their own join a visible neighbour.
  void give_away() {
    struct Shared {
      double open = 0, all = 0, longest = 0;
      DVec2 uv{0.0};  // of the middle of the longest side
    };
    std::map<uint32_t, std::map<uint32_t, Shared>> shared;  // by set
    for (const Meeting& m : meetings_)
      for (const auto& [a, b] :
           {std::pair(set_of_[m.a], set_of_[m.b]), std::pair(set_of_[m.b], set_of_[m.a])}) {
        if (a == b) continue;
        Shared& s = shared[a][b];
        s.all += m.length;
        if (!m.wall) s.open += m.length;
        if (m.length > s.longest) s.longest = m.length, s.uv = m.uv;
      }
    constexpr double kSpot = 1.0;  // texels
    at_point_.resize(all_.size());
    for (const auto& [set, neighbours] : shared) {
      const bool buried = is_buried(set);
      if (members_[set].empty() || (!buried && area_of(set) > kSpot * texel_ * texel_)) continue;
      uint32_t best = set;
      double most = 0;
      for (const auto& [other, by] : neighbours) {
        const double length = buried ? by.all : by.open;
        if (!members_[other].empty() && !at_point_[members_[other][0]] && length > most)
          best = other, most = length;
      }
      if (best == set) continue;
      if (buried)
        for (const uint32_t p : members_[set]) at_point_[p] = neighbours.at(best).uv;
      unite(best, set);
    }
  }
  double area_of(const Polygon& p) const {
    double twice = 0;
    for (size_t k = 0; k < p.points.size(); ++k) {
      const DVec2 &a = p.points[k].at, &b = p.points[(k + 1) % p.points.size()].at;
      twice += a.x * b.y - a.y * b.x;
    }
    return 0.5 * twice;
  }
  double area_of(uint32_t set) const {
    double area = 0;
    for (const uint32_t p : members_[set]) area += area_of(*all_[p]);
    return area;
  }
  // Whether all test points are buried: the centre of each polygon, the points between it and the corners,
  // and in wide polygons more, half a texel apart.
  bool is_buried(uint32_t set) const {
    for (const uint32_t i : members_[set]) {
      const Polygon& p = *all_[i];
      const DVec2 middle = middle_of(p), centre = flatten(p.triangle).at(middle);
      if (!is_buried_(p.triangle, middle)) return false;
      for (const Point& q : p.points) {
        const auto steps = static_cast<int>(std::clamp(length(q.at - centre) / (0.5 * texel_), 1.0, 64.0));
        for (int s = 1; s <= steps; ++s)
          if (!is_buried_(p.triangle, middle + (s - 0.1) / steps * (q.bary - middle))) return false;
      }
    }
    return !members_[set].empty();
  }
  static DVec2 middle_of(const Polygon& p) {
    DVec2 middle(0.0);
    for (const Point& q : p.points) middle += q.bary;
    middle /= static_cast<double>(p.points.size());
    return DVec2(on_grid(middle.x), on_grid(middle.y));
  }

  void merge(uint32_t a, uint32_t b) {
    if (a == b) return;
    if (members_[a].size() < members_[b].size()) std::swap(a, b);
    for (const uint32_t p : members_[b])
      for (const uint32_t q : apart_[p])
        if (set_of_[q] == a) return;
    unite(a, b);
  }
  void unite(uint32_t a, uint32_t b) {
    for (const uint32_t p : members_[b]) set_of_[p] = a;
    members_[a].insert(members_[a].end(), members_[b].begin(), members_[b].end());
    members_[b] = {};
  }

  MeshCharts faces() {
    MeshCharts out;
    out.generated = base_.generated;
    constexpr uint32_t kNone = ~0u;
    std::vector<uint32_t> number(all_.size(), kNone);
    for (uint32_t i = 0; i < all_.size(); ++i) {
      uint32_t& chart = number[set_of_[i]];
      if (chart == kNone) chart = out.chart_count++;
      const size_t first = out.corner_uv.size();
      add_faces(*all_[i], chart, out);
      if (at_point_[i])
        std::fill(out.corner_uv.begin() + static_cast<std::ptrdiff_t>(first), out.corner_uv.end(),
                  Vec2(*at_point_[i]));
    }
    return out;
  }

  void add_face(const Polygon& p, const DVec2& a, const DVec2& b, const DVec2& c, uint32_t chart,
                MeshCharts& out) const {
    FacePart part;
    part.triangle = p.triangle;
    const DVec2 corners[3] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
      part.corner[k] = Vec2(corners[k]);
      out.corner_uv.push_back(Vec2(uv_of(p.triangle, corners[k])));
    }
    out.parts.push_back(part);
    out.chart_of_face.push_back(chart);
  }
  void add_faces(const Polygon& p, uint32_t chart, MeshCharts& out) const {
    const size_t n = p.points.size();
    if (n == 3) {
      add_face(p, p.points[0].bary, p.points[1].bary, p.points[2].bary, chart, out);
      return;
    }
    // A fan around the centre: every face has area, whatever points lie on the polygon's sides.
    const DVec2 middle = middle_of(p);
    for (size_t k = 0; k < n; ++k)
      add_face(p, middle, p.points[k].bary, p.points[(k + 1) % n].bary, chart, out);
  }

  // Tolerance for lying on a line, in metres: below the spacing of sites, above rounding.
  double least() const { return 1e-4 * texel_; }

  const Mesh& mesh_;
  const Mat4x3& to_world_;
  const MeshCharts& base_;
  std::span<const Contact> contacts_;
  const double texel_;
  const std::function<bool(uint32_t, const DVec2&)>& is_buried_;
  const std::vector<uint32_t> weld_;
  uint32_t points_ = 0;
  std::map<PointKey, uint32_t> ids_;
  std::map<std::pair<uint32_t, uint32_t>, std::vector<double>> on_side_;  // points, from the smaller weld
  std::vector<std::vector<Polygon>> polygons_of_;                         // by triangle
  std::set<std::pair<uint32_t, uint32_t>> walls_;  // sides with a contact, by point ids
  std::vector<const Polygon*> all_;
  std::vector<Meeting> meetings_;
  std::vector<std::vector<uint32_t>> apart_;  // by polygon: those on the other side of a contact
  std::vector<uint32_t> set_of_;
  std::vector<std::vector<uint32_t>> members_;
  std::vector<std::optional<DVec2>> at_point_;  // by polygon: hidden; its texel coordinates
};

}  // namespace

MeshCharts cut_charts(const Mesh& mesh, const Mat4x3& to_world, const MeshCharts& base,
                      std::span<const Contact> contacts, double texel,
                      const std::function<bool(uint32_t, const DVec2&)>& is_buried, size_t& refused) {
  if (contacts.empty()) return {};
  // First find the charts that are divided at all: most contacts run along borders and cut nothing.
  const std::vector<bool> divided = Cutter(mesh, to_world, base, contacts, texel, is_buried).divided(refused);
  if (std::find(divided.begin(), divided.end(), true) == divided.end()) return {};
  // A chart of few texels is a blur either way, cut or not.
  std::vector<double> area(base.chart_count);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    Vec3 c[3];
    face_corners(mesh, base, t, c);
    area[base.chart_of_face[t]] += 0.5 * length(cross(DVec3(transform_vector(to_world, c[1] - c[0])),
                                                      DVec3(transform_vector(to_world, c[2] - c[0]))));
  }
  std::vector<Contact> needed;
  for (const Contact& c : contacts)
    if (divided[base.chart_of_face[c.triangle]] &&
        area[base.chart_of_face[c.triangle]] >= kMinChart * texel * texel)
      needed.push_back(c);
  if (needed.empty()) return {};
  size_t again = 0;
  return Cutter(mesh, to_world, base, needed, texel, is_buried).cut(again);
}

}  // namespace kiln
