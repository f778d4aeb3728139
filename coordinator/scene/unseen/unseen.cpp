#include "coordinator/scene/unseen/unseen.h"

#include <algorithm>

#include "common/atlas/atlas_lookup.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "common/unwrap/charts.h"
#include "coordinator/scene/unseen/chart_points.h"

namespace kiln {
namespace {

constexpr float kFar = 1e30f;
constexpr uint64_t kMinTexels = 4;

// Number of points on a chart, and rays or paths from each.
struct Effort {
  uint32_t points, rays, bounces;
  size_t corners;
};
Effort first_effort(uint64_t texels) {
  if (texels <= kMinTexels) return {4, 8, 1, 0};
  return {static_cast<uint32_t>(std::clamp<uint64_t>(texels / 4, 16, 64)), 16, 1, 0};
}
Effort second_effort(uint64_t texels) {
  return {static_cast<uint32_t>(std::clamp<uint64_t>(2 * texels, 16, 512)), 16, 8, 96};
}

// Points of one chart; each is a node of the region graph, with a second node for the back where that counts.
struct ChartNodes {
  std::vector<ChartPoint> points;
  uint32_t first = 0;
  uint32_t node(size_t k, bool back) const {
    return first + static_cast<uint32_t>(k + (back ? points.size() : 0));
  }
};

using Links = std::vector<std::pair<uint32_t, uint32_t>>;

class Search {
 public:
  Search(const Scene& scene, const ChartsToSize& charts, const Solid& solid, const SceneRays& rays,
         const Seeds& seeds, unsigned threads)
      : scene_(scene),
        charts_(charts),
        atlas_(charts.atlas),
        solid_(solid),
        rays_(rays),
        seeds_(seeds),
        threads_(threads),
        lookup_(charts.atlas),
        first_object_(static_cast<uint32_t>(seeds.places.size()) + 1),
        nodes_(first_object_ + 2 * static_cast<uint32_t>(scene.instances.size())),
        regions_(0) {
    for (const MeshCharts& set : atlas_.charts) faces_.push_back(triangles_by_chart(set));
    for (uint32_t i = 0; i < scene.instances.size(); ++i)
      instance_of_.resize(atlas_.instance_first_chart[i + 1], i);
  }

  std::vector<uint8_t> run() {
    std::vector<uint8_t> unseen(instance_of_.size(), 1);
    known_ = points_of(unseen, false);
    regions_ = UnionFind(nodes_);
    join(seeds_.places.size(), [&](size_t k, Links& links) { look_around(static_cast<uint32_t>(k), links); });
    look_from(known_, false);
    unseen = unseen_by(known_);
    for (size_t p = 0; p < unseen.size(); ++p) unseen[p] &= charts_.texels[p] > kMinTexels;
    seen_ = seen_regions();
    const std::vector<ChartNodes> more = points_of(unseen, true);
    UnionFind wider(nodes_);
    for (uint32_t n = 0; n < more_from_; ++n) wider.merge(n, regions_.find(n));
    regions_ = std::move(wider);
    look_from(more, true);
    const std::vector<uint8_t> first = unseen_by(known_), second = unseen_by(more);
    for (size_t p = 0; p < unseen.size(); ++p) unseen[p] &= first[p] && second[p];
    return unseen;
  }

 private:
  uint32_t outside() const { return first_object_ - 1; }  // seeds come first
  uint32_t object(uint32_t instance, bool back) const { return first_object_ + 2 * instance + back; }

  // For the marked charts.
  std::vector<ChartNodes> points_of(const std::vector<uint8_t>& which, bool again) {
    more_from_ = nodes_;
    std::vector<ChartNodes> all(which.size());
    parallel_for(
        all.size(),
        [&](size_t p) {
          if (!which[p]) return;
          const uint32_t instance = instance_of_[p];
          const uint32_t chart = static_cast<uint32_t>(p) - atlas_.instance_first_chart[instance];
          const ChartSurface surface(scene_, atlas_, instance,
                                     faces_[atlas_.charts_of_instance[instance]].of(chart));
          if (surface.empty()) return;
          const Effort effort = again ? second_effort(charts_.texels[p]) : first_effort(charts_.texels[p]);
          const uint64_t key = key_of(p, again);
          for (uint32_t k = 0; k < effort.points; ++k)
            all[p].points.push_back(surface.spread(k, effort.points, key));
          if (effort.corners == 0) return;
          for (const ChartPoint& corner : surface.corners(effort.corners)) all[p].points.push_back(corner);
        },
        threads_);
    for (ChartNodes& chart : all) {
      chart.first = nodes_;
      nodes_ += static_cast<uint32_t>(2 * chart.points.size());
    }
    return all;
  }
  static uint64_t key_of(size_t placement, bool again) { return mix_bits(uint64_t{placement} << 1 | again); }

  template <class Look>
  void join(size_t count, const Look& look) {
    std::vector<Links> links(count);
    parallel_for(
        count,
        [&](size_t i) {
          look(i, links[i]);
          std::sort(links[i].begin(), links[i].end());
          links[i].erase(std::unique(links[i].begin(), links[i].end()), links[i].end());
        },
        threads_);
    for (const Links& some : links)
      for (const auto& [a, b] : some) regions_.merge(a, b);
  }

  static float offset(const Vec3& p) {
    return 4e-6f * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), 1e-3f});
  }
  bool is_free(const Vec3& from, const Vec3& to) const {
    RayHit hit;
    return !rays_.closest(from, to - from, 1.0f, hit, [&](const RayHit& h) { return solid_.stops(h); });
  }

  // Whether there is a free path from just above one point of a surface to just above another: straight along
  // it, or an arch over obstacles.
  bool is_beside(const Vec3& a, const Vec3& up_a, const Vec3& b, const Vec3& up_b) const {
    const float low = offset(a), high = 0.25f * length(b - a);
    const Vec3 from = a + low * up_a, to = b + low * up_b;
    if (is_free(from, to)) return true;
    const Vec3 over_a = from + high * up_a, over_b = to + high * up_b;
    return is_free(over_a, over_b) && is_free(from, over_a) && is_free(to, over_b);
  }

  // The charts, or objects without charts, that a point is already linked to: one link each is enough.
  struct Met {
    std::vector<uint32_t> sides;  // of charts
    bool holds(uint32_t side) const { return std::find(sides.begin(), sides.end(), side) != sides.end(); }
  };

  // The chart's point nearest to a hit; false for an invisible back, covered surface, a chart already hit, or
  // no point near enough.
  bool node_of(const RayHit& hit, const Vec3& at, Met& met, uint32_t& node) const {
    if (!solid_.shows(hit)) return false;
    node = object(hit.instance, hit.back);
    if (solid_.emits(hit.instance)) return true;
    if (!lookup_.holds(hit.instance, hit.triangle)) return true;
    double b1 = double{hit.b1}, b2 = double{hit.b2};
    const uint32_t face = lookup_.face_at(hit.instance, hit.triangle, b1, b2);
    const MeshCharts& set = atlas_.of_instance(hit.instance);
    if (area2(uv_triangle(set, face)) == 0)
      return set.parts.empty();  // else cut away below a standing object
    const uint32_t placement = atlas_.instance_first_chart[hit.instance] + set.chart_of_face[face];
    if (met.holds(2 * placement + hit.back)) return false;
    const ChartNodes& chart = known_[placement];
    const Vec3 up = normal_of(hit);
    const float side = hit.back ? -1.0f : 1.0f;
    for (const size_t k : nearest(chart.points, at)) {
      if (!is_beside(at, up, chart.points[k].position, side * chart.points[k].normal)) continue;
      node = chart.node(k, hit.back);
      met.sides.push_back(2 * placement + hit.back);
      return true;
    }
    return false;
  }

  static std::vector<size_t> nearest(const std::vector<ChartPoint>& points, const Vec3& at) {
    constexpr size_t kMax = 4;
    std::vector<std::pair<float, size_t>> order;
    for (size_t k = 0; k < points.size(); ++k) {
      const Vec3 d = points[k].position - at;
      order.emplace_back(dot(d, d), k);
    }
    const auto end = order.begin() + static_cast<ptrdiff_t>(std::min(kMax, order.size()));
    std::partial_sort(order.begin(), end, order.end());
    std::vector<size_t> first;
    for (auto it = order.begin(); it != end; ++it) first.push_back(it->second);
    return first;
  }

  void look_around(uint32_t seed, Links& links) const {
    const auto seeds = static_cast<uint32_t>(seeds_.places.size());
    const uint32_t rays = std::max<uint32_t>(64, 65536 / std::max<uint32_t>(64, seeds));
    const Seed& place = seeds_.places[seed];
    const auto accept = [&](const RayHit& h) {
      return solid_.stops(h) && (!place.camera || solid_.shows(h));
    };
    for (uint32_t k = 0; k < rays; ++k) {
      const Vec2 u = SampleStream(1, seed, k).pair(0);
      const Vec3 d = spherical(2 * u.x - 1, u.y);
      RayHit hit;
      Met met;
      uint32_t node = outside();
      if (rays_.closest(place.position, d, kFar, hit, accept) &&
          !node_of(hit, place.position + hit.distance * d, met, node))
        continue;
      links.emplace_back(seed, node);
    }
  }

  void look_from(const std::vector<ChartNodes>& charts, bool again) {
    join(charts.size(), [&](size_t p, Links& links) {
      const ChartNodes& chart = charts[p];
      const uint32_t instance = instance_of_[p];
      const Effort effort = again ? second_effort(charts_.texels[p]) : first_effort(charts_.texels[p]);
      for (size_t k = 0; k < chart.points.size() && !is_seen(links); ++k) {
        const uint64_t key = key_of(p, again) + k + 1;
        ChartPoint point = chart.points[k];
        look_from(point, instance, chart.node(k, false), effort, key, links);
        if (!solid_.two_sided(instance)) continue;
        point.normal = -point.normal;
        look_from(point, instance, chart.node(k, true), effort, key, links);
      }
    });
  }

  // Whether a link reached a region that was already seen before this batch of points.
  bool is_seen(const Links& links) const {
    return !seen_.empty() && std::any_of(links.begin(), links.end(), [&](const auto& link) {
      return link.second < seen_.size() && seen_[link.second];
    });
  }

  void look_from(const ChartPoint& point, uint32_t instance, uint32_t from, const Effort& effort,
                 uint64_t key, Links& links) const {
    const Vec3& p = point.position;
    uint32_t own = instance, own_triangle = point.triangle;
    const auto other = [&](const RayHit& h) {
      return solid_.stops(h) && !(h.instance == own && h.triangle == own_triangle);
    };
    RayHit hit;
    // Pressed against another surface, as the foot of a cupboard on the floor.
    const float gap = kContactGap * static_cast<float>(charts_.texel[instance]);
    if (rays_.closest(p - offset(p) * point.normal, point.normal, gap + 2 * offset(p), hit,
                      [&](const RayHit& h) { return !h.back && other(h); }))
      return;
    if (effort.bounces > 1)
      look_at_seeds(p + offset(p) * point.normal, point.normal, from, key, other, links);
    Met met;
    for (uint32_t k = 0; k < effort.rays; ++k) {
      own = instance;
      own_triangle = point.triangle;
      Vec3 at = p, up = point.normal;
      for (uint32_t bounce = 0; bounce < effort.bounces; ++bounce) {
        at += offset(at) * up;
        const Vec3 d = Frame(up).to_world(cosine_hemisphere(SampleStream(key, 1, k).pair(bounce)));
        if (!rays_.closest(at, d, kFar, hit, other)) {
          links.emplace_back(from, outside());
          break;
        }
        if (!solid_.shows(hit)) break;
        at += hit.distance * d;
        uint32_t node;
        if (node_of(hit, at, met, node)) links.emplace_back(from, node);
        own = hit.instance;
        own_triangle = hit.triangle;
        up = normal_of(hit);
      }
    }
  }

  // Towards the ray's origin.
  Vec3 normal_of(const RayHit& hit) const {
    const Instance& instance = scene_.instances[hit.instance];
    const Mesh& mesh = scene_.meshes[instance.mesh];
    const UVec3& t = mesh.triangles[hit.triangle];
    const Vec3 c[3] = {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
    return (hit.back ? -1.0f : 1.0f) * front_normal(instance.to_world, c);
  }

  template <class Accept>
  void look_at_seeds(const Vec3& origin, const Vec3& normal, uint32_t from, uint64_t key, const Accept& other,
                     Links& links) const {
    constexpr uint32_t kMax = 64;  // of a point
    const auto seeds = static_cast<uint32_t>(seeds_.places.size());
    const uint32_t first = seeds > kMax ? static_cast<uint32_t>(mix_bits(key) % seeds) : 0;
    for (uint32_t k = 0; k < std::min(seeds, kMax); ++k) {
      const uint32_t s = (first + k) % seeds;
      const Seed& seed = seeds_.places[s];
      const Vec3 d = seed.position - origin;
      if (!(dot(d, normal) > 0)) continue;
      RayHit hit;
      // A camera sees through surfaces that face away from it, which show their front to the point.
      const auto stops = [&](const RayHit& h) {
        return other(h) && !(seed.camera && !h.back && !solid_.two_sided(h.instance));
      };
      if (!rays_.closest(origin, d, 1.0f, hit, stops)) links.emplace_back(from, s);
    }
  }

  // By node: whether its region is seen.
  std::vector<uint8_t> seen_regions() {
    std::vector<uint8_t> roots(nodes_, 0), seen(nodes_);
    const auto see = [&](uint32_t node) { roots[regions_.find(node)] = 1; };
    for (uint32_t k = 0; k < seeds_.places.size(); ++k) see(k);
    if (seeds_.sky) see(outside());
    for (uint32_t i = 0; i < scene_.instances.size(); ++i)
      for (const bool back : {false, true})
        if (solid_.emits(i) && (!back || solid_.two_sided(i))) see(object(i, back));
    for (uint32_t n = 0; n < nodes_; ++n) seen[n] = roots[regions_.find(n)];
    return seen;
  }

  std::vector<uint8_t> unseen_by(const std::vector<ChartNodes>& charts) {
    const std::vector<uint8_t> seen = seen_regions();
    std::vector<uint8_t> unseen(charts.size(), 1);
    for (size_t p = 0; p < charts.size(); ++p) {
      if (solid_.emits(instance_of_[p])) unseen[p] = 0;
      for (size_t k = 0; k < charts[p].points.size(); ++k) {
        unseen[p] &= !seen[charts[p].node(k, false)];
        if (solid_.two_sided(instance_of_[p])) unseen[p] &= !seen[charts[p].node(k, true)];
      }
    }
    return unseen;
  }

  const Scene& scene_;
  const ChartsToSize& charts_;
  const Atlas& atlas_;
  const Solid& solid_;
  const SceneRays& rays_;
  const Seeds& seeds_;
  const unsigned threads_;
  const AtlasLookup lookup_;
  const uint32_t first_object_;
  uint32_t nodes_, more_from_ = 0;
  UnionFind regions_;
  std::vector<ChartTriangles> faces_;  // by set of charts
  std::vector<uint32_t> instance_of_;  // by placement
  std::vector<uint8_t> seen_;          // by node, after the first round; empty in it
  std::vector<ChartNodes> known_;      // by placement: points that hits on a chart are matched with
};

}  // namespace

UnseenCharts::UnseenCharts(const Scene& scene, const std::vector<Viewpoint>& cameras, unsigned threads)
    : scene_(scene),
      threads_(threads),
      solid_(scene),
      rays_(scene, threads),
      seeds_(find_seeds(scene, cameras, solid_)),
      decides_(seeds_.any(solid_, scene.instances.size())) {}

std::vector<uint8_t> UnseenCharts::find(const ChartsToSize& charts) const {
  if (!decides_) return std::vector<uint8_t>(charts.texels.size(), 0);
  return Search(scene_, charts, solid_, rays_, seeds_, threads_).run();
}

}  // namespace kiln
