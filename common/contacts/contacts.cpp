// Tests every pair of nearby triangles, in double. The line where one leaves the plane of the other is
// computed a little above the plane, where the intersection is well conditioned, and moved down along the
// crossing triangle, so a wall that ends exactly on the floor, or slightly above it, counts like one that
// goes through.
#include "common/contacts/contacts.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <numeric>
#include <optional>
#include <tuple>
#include <unordered_map>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "common/contacts/triangle_tree.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr double kMinLength = 1e-3;  // texels
constexpr double kParallel =
    0.94;  // |cosine| between normals above which surfaces count as parallel: 20 degrees

bool lets_light_through(const Record& material) {
  const Property* alpha = material.find("alpha_mode");
  if (alpha && alpha->word != "opaque") return true;
  const Property* glass = material.find("transmission");
  return glass && !glass->numbers.empty() && glass->numbers[0] > 0;
}

// A contact found, before short ones are dropped.
struct Found {
  uint32_t instance;
  Contact contact;
  ContactLine line;
};

// The plane and barycentrics of the triangle below.
struct Ground {
  DVec3 origin, e1, e2, normal;
  double g11, g12, g22, det;

  explicit Ground(const WorldTriangle& t, bool mirrored)
      : origin(t.corner[0]), e1(DVec3(t.corner[1]) - origin), e2(DVec3(t.corner[2]) - origin) {
    const DVec3 n = cross(e1, e2) * (mirrored ? -1.0 : 1.0);
    const double size = length(n);
    normal = size > 0 ? n / size : DVec3(0.0);
    g11 = dot(e1, e1);
    g12 = dot(e1, e2);
    g22 = dot(e2, e2);
    det = g11 * g22 - g12 * g12;
  }
  bool flat() const { return !(det > 0) || !(dot(normal, normal) > 0); }
  DVec2 barycentrics(const DVec3& p) const {
    const DVec3 d = p - origin;
    const double x = dot(d, e1), y = dot(d, e2);
    return DVec2(g22 * x - g12 * y, g11 * y - g12 * x) / det;
  }
  DVec3 at(const DVec2& b) const { return origin + b.x * e1 + b.y * e2; }
};

// Clips the segment to the triangle grown by `slack` (in barycentrics). Returns false if nothing is left.
bool clip(DVec2& a, DVec2& b, double slack) {
  double t0 = 0, t1 = 1;
  const auto keep = [&](double at_a, double at_b) {  // where the value is >= -slack
    if (at_a < -slack && at_b < -slack) return false;
    const double d = at_b - at_a;
    if (at_a < -slack) t0 = std::max(t0, (-slack - at_a) / d);
    if (at_b < -slack) t1 = std::min(t1, (-slack - at_a) / d);
    return t0 < t1;
  };
  if (!keep(a.x, b.x) || !keep(a.y, b.y) || !keep(1 - a.x - a.y, 1 - b.x - b.y)) return false;
  const DVec2 from = a, d = b - a;
  const auto inside = [](DVec2 p) {
    p = glm::max(p, DVec2(0.0));
    const double sum = p.x + p.y;
    return sum > 1 ? p / sum : p;
  };
  a = inside(from + t0 * d);
  b = inside(from + t1 * d);
  return true;
}

// The line where `by` rises from the front of the ground; its ends are in the plane.
bool rising_line(const Ground& ground, const WorldTriangle& by, double texel, DVec3 (&ends)[2]) {
  const double level = kContactGap * texel;
  double height[3];
  for (int k = 0; k < 3; ++k) height[k] = dot(ground.normal, DVec3(by.corner[k]) - ground.origin);
  if (std::min({height[0], height[1], height[2]}) > level) return false;
  if (std::max({height[0], height[1], height[2]}) < kContactRise * texel) return false;
  const DVec3 c0(by.corner[0]);
  const DVec3 n = cross(DVec3(by.corner[1]) - c0, DVec3(by.corner[2]) - c0);
  const double size = length(n);
  const double along = size > 0 ? dot(n, ground.normal) / size : 1.0;
  if (!(std::abs(along) < kParallel)) return false;
  int found = 0;
  for (int k = 0; k < 3 && found < 2; ++k) {
    const int m = (k + 1) % 3;
    if ((height[k] > level) == (height[m] > level)) continue;
    const double t = (level - height[k]) / (height[m] - height[k]);
    ends[found++] = DVec3(by.corner[k]) + t * (DVec3(by.corner[m]) - DVec3(by.corner[k]));
  }
  if (found < 2) return false;
  const DVec3 flat = n / size - along * ground.normal;  // in the plane, across the line
  const DVec3 down = -level * ground.normal + level * along / dot(flat, flat) * flat;
  for (DVec3& e : ends) e += down;
  return true;
}

}  // namespace

class ContactFinder::Search {
 public:
  Search(const Scene& scene, std::span<const double> texel, unsigned threads)
      : scene_(scene), texel_(texel), threads_(threads) {
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
      first_.push_back(static_cast<uint32_t>(triangles_.size()));
      mirrored_.push_back(determinant(scene.instances[i].to_world) < 0);
      const Record& material = scene.materials[scene.instances[i].material];
      blocks_.push_back(scene.instances[i].cast && !lets_light_through(material));
      const Property* sided = material.find("double_sided");
      double_sided_.push_back(sided && !sided->numbers.empty() && sided->numbers[0] != 0);
      const auto count = static_cast<uint32_t>(scene.meshes[scene.instances[i].mesh].triangles.size());
      for (uint32_t t = 0; t < count; ++t) triangles_.push_back(world_triangle(scene, i, t));
    }
    find_distinct();
    tree_.emplace(distinct_);
  }

  // Whether there are too many pairs depends on their sum alone, so it is the same for any number of threads.
  std::vector<Found> run(const std::function<bool()>& is_stopped, uint64_t max_pairs, bool& given_up) const {
    const uint64_t most = max_pairs + kPairsOfTriangle * triangles_.size();
    const uint64_t most_found = kMaxContacts + kContactsOfTriangle * triangles_.size();
    std::atomic<uint64_t> pairs{0}, contacts{0};
    const auto too_many = [&] { return pairs > most || contacts > most_found; };
    constexpr size_t kChunk = 1024;
    std::vector<std::vector<Found>> parts((triangles_.size() + kChunk - 1) / kChunk);
    parallel_for(
        parts.size(),
        [&](size_t part) {
          if (is_stopped && is_stopped()) return;
          for (size_t i = part * kChunk; i < std::min(triangles_.size(), (part + 1) * kChunk); ++i) {
            if (too_many()) return;
            const size_t before = parts[part].size();
            pairs += look_at(triangles_[i], parts[part]);
            contacts += parts[part].size() - before;
          }
        },
        threads_);
    given_up = too_many();
    if (given_up) return {};
    std::vector<Found> all;
    for (auto& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  bool is_buried(uint32_t instance, uint32_t triangle, const DVec2& b) const {
    const WorldTriangle& t = triangles_[first_[instance] + triangle];
    const Ground ground(t, mirrored_[instance]);
    if (ground.flat()) return false;
    return is_buried(ground.at(b) + 2 * kContactGap * texel_[instance] * ground.normal, ground.normal,
                     texel_[instance]);
  }
  size_t instances() const { return scene_.instances.size(); }
  double texel(uint32_t instance) const { return texel_[instance]; }

 private:
  // Where two surfaces coincide the back face counts first: a crate on a crate hides the inside of the lower
  // one.
  bool is_buried(const DVec3& at, const DVec3& up, double texel) const {
    double inner = 1e300, outer = 1e300, end = 1e300;
    tree_->for_each_hit(at, up, end, [&](uint32_t index, double distance) {
      const WorldTriangle& t = distinct_[index];
      if (!scene_.instances[t.instance].cast) return;
      const DVec3 c(t.corner[0]);
      const double facing = dot(up, cross(DVec3(t.corner[1]) - c, DVec3(t.corner[2]) - c));
      const bool is_inner = !double_sided_[t.instance] && (facing > 0) != mirrored_[t.instance];
      double& nearest = is_inner ? inner : outer;
      nearest = std::min(nearest, distance);
      end = std::min(end, nearest + kContactGap * texel);
    });
    return inner < 1e300 && inner <= outer + kContactGap * texel;
  }
  // Whether the triangles share two corners, as neighbours in a surface do.
  static int common_corners(const WorldTriangle& a, const WorldTriangle& b) {
    int count = 0;
    for (const Vec3& p : a.corner)
      for (const Vec3& q : b.corner) count += p == q;
    return count;
  }

  // Of triangles that are one surface in the world, only the first is asked for: a thousand copies of a wall
  // on one place would make a million contacts of one line.
  void find_distinct() {
    KILN_CHECK(triangles_.size() < uint64_t{1} << 32);
    std::vector<uint32_t> order(triangles_.size());
    std::iota(order.begin(), order.end(), 0u);
    // What is asked of a triangle besides its corners.
    const auto kind = [&](const WorldTriangle& t) {
      return blocks_[t.instance] | double_sided_[t.instance] << 1 | mirrored_[t.instance] << 2 |
             scene_.instances[t.instance].cast << 3;
    };
    const auto compare = [&](uint32_t a, uint32_t b) {
      const WorldTriangle &s = triangles_[a], &t = triangles_[b];
      const int bytes = std::memcmp(s.corner, t.corner, sizeof s.corner);
      return bytes ? bytes : kind(s) - kind(t);
    };
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      const int difference = compare(a, b);
      return difference ? difference < 0 : a < b;
    });
    std::vector<uint32_t> firsts;
    std::vector<bool> repeated(triangles_.size());  // by triangle, of the firsts
    for (size_t i = 0; i < order.size(); ++i) {
      if (i > 0 && compare(order[i - 1], order[i]) == 0)
        repeated[firsts.back()] = true;
      else
        firsts.push_back(order[i]);
    }
    std::sort(firsts.begin(), firsts.end());
    for (const uint32_t first : firsts) {
      distinct_.push_back(triangles_[first]);
      repeated_.push_back(repeated[first]);
    }
  }

  // Returns the number of triangles that were near it.
  uint64_t look_at(const WorldTriangle& on, std::vector<Found>& found) const {
    if (!scene_.instances[on.instance].receive) return 0;
    const Ground ground(on, mirrored_[on.instance]);
    if (ground.flat()) return 0;
    uint64_t pairs = 0;
    const double texel = texel_[on.instance];
    Box3 box = on.box();
    box.low -= DVec3(kContactGap * texel);
    box.high += DVec3(kContactGap * texel);
    const double slack = 1e-4 * texel * std::sqrt(std::max(ground.g11, ground.g22) / ground.det);
    tree_->for_each(box, [&](uint32_t index) {
      ++pairs;
      const WorldTriangle& by = distinct_[index];
      if (!blocks_[by.instance]) return;
      DVec3 ends[2];
      if (!rising_line(ground, by, texel, ends)) return;
      DVec2 a = ground.barycentrics(ends[0]), b = ground.barycentrics(ends[1]);
      // Without slack first: clamping a line that extends past a side would rotate it.
      const DVec2 whole_a = a, whole_b = b;
      if (!clip(a, b, 0)) {
        a = whole_a, b = whole_b;
        if (!clip(a, b, slack)) return;
      }
      if (length(ground.at(a) - ground.at(b)) < kMinLength * texel) return;
      // The next face of a surface that bends upwards is not a contact.
      const bool own = on.instance == by.instance && !repeated_[index];
      if (own && common_corners(on, by) == 2 && on_a_side(a, b)) return;
      if (b.x < a.x || (b.x == a.x && b.y < a.y)) std::swap(a, b);
      found.push_back(
          {on.instance, {on.triangle, a, b}, {Vec3(ground.at(a)), Vec3(ground.at(b)), Vec3(ground.normal)}});
    });
    return pairs;
  }
  static bool on_a_side(const DVec2& a, const DVec2& b) {
    constexpr double kNear = 1e-6;
    return (a.x < kNear && b.x < kNear) || (a.y < kNear && b.y < kNear) ||
           (1 - a.x - a.y < kNear && 1 - b.x - b.y < kNear);
  }

  const Scene& scene_;
  std::span<const double> texel_;
  unsigned threads_;
  std::vector<uint32_t> first_;
  std::vector<bool> mirrored_, blocks_, double_sided_;
  std::vector<WorldTriangle> triangles_;
  std::vector<WorldTriangle> distinct_;  // without those that lie on an earlier one corner by corner
  std::vector<bool> repeated_;           // by distinct triangle: other instances have it too
  std::optional<TriangleTree> tree_;     // of the distinct ones
};

namespace {

// Selects the contacts of one instance that connect over at least kContactReach texels.
std::vector<bool> reach_far(std::span<const Found> found, double texel) {
  using Cell = std::array<int64_t, 3>;
  const double cell_size = 0.05 * texel;
  const auto cell_of = [&](const Vec3& p) {
    Cell c;
    for (int k = 0; k < 3; ++k) c[k] = static_cast<int64_t>(std::floor(double{p[k]} / cell_size));
    return c;
  };
  const auto hash = [](const Cell& c) {
    uint64_t h = 0;
    for (const int64_t k : c) h = (h ^ static_cast<uint64_t>(k)) * 0x9e3779b97f4a7c15u, h ^= h >> 29;
    return static_cast<size_t>(h);
  };
  std::unordered_map<Cell, uint32_t, decltype(hash)> first(4 * found.size(), hash);
  UnionFind sets(found.size());
  for (uint32_t i = 0; i < found.size(); ++i)
    for (const Vec3& end : {found[i].line.a, found[i].line.b}) {
      const Cell at = cell_of(end);
      for (int k = 0; k < 27; ++k) {
        const auto near = first.find({at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1});
        if (near != first.end()) sets.merge(near->second, i);
      }
      first.emplace(at, i);
    }
  std::vector<Box3> boxes(found.size());
  for (uint32_t i = 0; i < found.size(); ++i) {
    Box3& box = boxes[sets.find(i)];
    box.add(DVec3(found[i].line.a));
    box.add(DVec3(found[i].line.b));
  }
  std::vector<bool> far(found.size());
  for (uint32_t i = 0; i < found.size(); ++i) {
    const Box3& box = boxes[sets.find(i)];
    far[i] = length(box.high - box.low) >= kContactReach * texel;
  }
  return far;
}

}  // namespace

ContactFinder::ContactFinder(const Scene& scene, std::span<const double> texel, unsigned threads)
    : search_(std::make_unique<Search>(scene, texel, threads)) {}
ContactFinder::~ContactFinder() = default;

bool ContactFinder::is_buried(uint32_t instance, uint32_t triangle, const DVec2& b) const {
  return search_->is_buried(instance, triangle, b);
}

Contacts ContactFinder::find(const std::function<bool()>& is_stopped, uint64_t max_pairs) const {
  Contacts contacts;
  const std::vector<Found> found = search_->run(is_stopped, max_pairs, contacts.given_up);
  contacts.of_instance.resize(search_->instances());
  for (size_t i = 0, end; i < found.size(); i = end) {
    const uint32_t instance = found[i].instance;
    for (end = i; end < found.size() && found[end].instance == instance;) ++end;
    const std::span<const Found> own(&found[i], end - i);
    const std::vector<bool> far = reach_far(own, search_->texel(instance));
    for (size_t k = 0; k < own.size(); ++k) {
      if (!far[k]) continue;
      contacts.of_instance[instance].push_back(own[k].contact);
      contacts.lines.push_back(own[k].line);
    }
  }
  return contacts;
}

}  // namespace kiln
