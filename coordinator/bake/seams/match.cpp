#include "coordinator/bake/seams/match.h"

#include "common/base/parallel.h"
#include "common/math/trig.h"
#include "coordinator/bake/seams/edge_tree.h"

namespace kiln {
namespace {

constexpr size_t kMaxPartners = 256;
constexpr double kPointsPerTexel = 4;
// In texels. Shorter stretches (triangles finer than texels) share one point per this much total length.
constexpr double kMinPoint = 1.0 / 16;
// Minimum length of a common stretch, in texels: edges that continue one another along a line touch in a
// point.
constexpr double kShortest = 1.0 / 256;
// Largest cosine between the directions into the two faces: a fold down to 84 degrees, which includes the
// corner of a box with one smooth normal and excludes a sheet folded back on itself.
constexpr float kMaxFold = 0.1f;
// Both sides read the same place when their coordinates agree to this, in texels.
constexpr double kSamePlace = 1e-3;

double tolerance_of(const BorderEdge& e, const SeamSettings& settings) {
  // Coordinates are floats: far from the origin their spacing sets the tolerance.
  const DVec3 a = glm::max(glm::abs(e.p[0]), glm::abs(e.p[1]));
  return settings.tolerance_texels * double{e.texel_size} + 0x1p-21 * std::max({a.x, a.y, a.z});
}

// Restricts [lo, hi] to t with |d0 + t d1| <= most; false if empty.
bool within_distance(const DVec3& d0, const DVec3& d1, double most, double& lo, double& hi) {
  const double a = dot(d1, d1), b = dot(d0, d1), c = dot(d0, d0) - most * most;
  if (a * hi * hi < 1e-12 * most * most) return c <= 0;
  const double root = b * b - a * c;
  if (!(root >= 0)) return false;
  lo = std::max(lo, (-b - std::sqrt(root)) / a);
  hi = std::min(hi, (-b + std::sqrt(root)) / a);
  return lo < hi;
}

bool common_stretch(const BorderEdge& a, const BorderEdge& b, double tolerance, SeamStretch& out) {
  if (dot(a.inward, b.inward) > kMaxFold) return false;
  const DVec3 along = a.p[1] - a.p[0];
  const double size = length(along);
  const DVec3 d = along / size;
  const double t0 = dot(b.p[0] - a.p[0], d), t1 = dot(b.p[1] - a.p[0], d);
  const double shortest = kShortest * double{std::min(a.texel_size, b.texel_size)};
  if (!(std::abs(t1 - t0) > shortest)) return false;
  double lo = std::max(0.0, std::min(t0, t1)), hi = std::min(size, std::max(t0, t1));
  if (!(hi - lo > shortest)) return false;
  // From a's point at t to b's point beside it.
  const DVec3 slope = (b.p[1] - b.p[0]) / (t1 - t0);
  if (!within_distance(b.p[0] - a.p[0] - t0 * slope, slope - d, tolerance, lo, hi)) return false;
  if (!(hi - lo > shortest)) return false;
  out.side[0].from = lo / size;
  out.side[0].to = hi / size;
  out.side[1].from = std::clamp((lo - t0) / (t1 - t0), 0.0, 1.0);
  out.side[1].to = std::clamp((hi - t0) / (t1 - t0), 0.0, 1.0);
  out.metres = hi - lo;
  return true;
}

struct Pair {
  uint32_t a, b;
  auto operator<=>(const Pair&) const = default;
};

// Pairs are found from either edge: a long edge drops some of its many short partners, which still find it.
std::vector<Pair> partners(std::span<const BorderEdge> edges, const EdgeTree& tree, uint32_t i,
                           const SeamSettings& settings) {
  std::vector<Pair> found;
  const double own = tolerance_of(edges[i], settings);
  tree.for_each_near(edges[i].p[0], edges[i].p[1], own, [&](uint32_t j) {
    SeamStretch s;
    const uint32_t a = std::min(i, j), b = std::max(i, j);
    if (i != j && common_stretch(edges[a], edges[b], std::min(own, tolerance_of(edges[j], settings)), s))
      found.push_back({a, b});
    return found.size() < kMaxPartners;
  });
  return found;
}

DVec3 normal_at(const BorderEdge& e, double t) {
  return DVec3(e.normal[0]) * (1 - t) + DVec3(e.normal[1]) * t;
}

// Whether something stands on a point.
class ContactMap {
 public:
  explicit ContactMap(std::span<const ContactLine> contacts) : lines_(as_edges(contacts)), tree_(lines_) {}

  bool holds(const DVec3& p, const DVec3& normal, double distance) const {
    bool found = false;
    tree_.for_each_near(p, p, distance, [&](uint32_t i) {
      const BorderEdge& line = lines_[i];
      const DVec3 along = line.p[1] - line.p[0];
      const double square = dot(along, along);
      const double t = square > 0 ? std::clamp(dot(p - line.p[0], along) / square, 0.0, 1.0) : 0.0;
      found = length(p - line.p[0] - t * along) <= distance && dot(DVec3(line.normal[0]), normal) > 0;
      return !found;
    });
    return found;
  }

 private:
  static std::vector<BorderEdge> as_edges(std::span<const ContactLine> contacts) {
    std::vector<BorderEdge> lines(contacts.size());
    for (size_t i = 0; i < lines.size(); ++i) {
      lines[i].p[0] = DVec3(contacts[i].a), lines[i].p[1] = DVec3(contacts[i].b);
      lines[i].normal[0] = contacts[i].normal;
    }
    return lines;
  }
  std::vector<BorderEdge> lines_;
  EdgeTree tree_;
};

bool normals_agree(const DVec3& a, const DVec3& b, double least_cosine) {
  const double square = dot(a, a) * dot(b, b);
  return square > 0 && dot(a, b) >= least_cosine * std::sqrt(square);
}

}  // namespace

std::vector<SeamStretch> coincident_stretches(std::span<const BorderEdge> edges,
                                              const SeamSettings& settings) {
  const EdgeTree tree(edges);
  constexpr size_t kChunk = 1024;
  std::vector<std::vector<Pair>> found((edges.size() + kChunk - 1) / kChunk);
  parallel_for(found.size(), [&](size_t chunk) {
    for (size_t i = chunk * kChunk; i < std::min(edges.size(), (chunk + 1) * kChunk); ++i) {
      const std::vector<Pair> some = partners(edges, tree, static_cast<uint32_t>(i), settings);
      found[chunk].insert(found[chunk].end(), some.begin(), some.end());
    }
  });
  std::vector<Pair> pairs;
  for (const std::vector<Pair>& some : found) pairs.insert(pairs.end(), some.begin(), some.end());
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<SeamStretch> stretches;
  stretches.reserve(pairs.size());
  for (const auto& [a, b] : pairs) {
    SeamStretch s;
    s.side[0].edge = a, s.side[1].edge = b;
    const double tolerance = std::min(tolerance_of(edges[a], settings), tolerance_of(edges[b], settings));
    if (common_stretch(edges[a], edges[b], tolerance, s)) stretches.push_back(s);
  }
  return stretches;
}

std::vector<SeamPoint> seam_points(std::span<const BorderEdge> edges, std::vector<SeamStretch>& stretches,
                                   std::span<const ContactLine> contacts, const SeamSettings& settings) {
  const ContactMap standing(contacts);
  // Minus the rounding of unit normals (a twelfth of a degree).
  const double least_cosine =
      double{sincos_turns(static_cast<float>(settings.angle_degrees / 360)).cos} - 1e-6;
  const auto points_on = [&](const SeamStretch& s, std::vector<SeamPoint>& points) {
    const BorderEdge* e[2] = {&edges[s.side[0].edge], &edges[s.side[1].edge]};
    double texels = 0;
    for (int k = 0; k < 2; ++k)
      texels =
          std::max(texels, std::abs(s.side[k].to - s.side[k].from) * length(e[k]->texel[1] - e[k]->texel[0]));
    const double count = std::max(1.0, std::ceil(kPointsPerTexel * texels));
    for (double i = 0; i < count; ++i) {
      SeamPoint p;
      DVec3 normal[2];
      for (int k = 0; k < 2; ++k) {
        const double t = s.side[k].from + (s.side[k].to - s.side[k].from) * ((i + 0.5) / count);
        p.texel[k] = e[k]->texel[0] + (e[k]->texel[1] - e[k]->texel[0]) * t;
        p.page[k] = e[k]->page;
        p.placement[k] = e[k]->placement;
        normal[k] = normal_at(*e[k], t);
      }
      if (!normals_agree(normal[0], normal[1], least_cosine)) continue;
      const DVec2 apart = glm::abs(p.texel[0] - p.texel[1]);
      if (p.page[0] == p.page[1] && std::max(apart.x, apart.y) < kSamePlace) continue;
      const double at = s.side[0].from + (s.side[0].to - s.side[0].from) * ((i + 0.5) / count);
      const DVec3 place = e[0]->p[0] + (e[0]->p[1] - e[0]->p[0]) * at;
      if (standing.holds(place, normal[0], tolerance_of(*e[0], settings))) continue;
      p.texels = texels / count;
      points.push_back(p);
    }
  };
  constexpr size_t kChunk = 1024;
  struct Found {
    std::vector<SeamPoint> points;
    std::vector<uint32_t> end;  // of each stretch, in `points`
  };
  std::vector<Found> found((stretches.size() + kChunk - 1) / kChunk);
  parallel_for(found.size(), [&](size_t chunk) {
    for (size_t i = chunk * kChunk; i < std::min(stretches.size(), (chunk + 1) * kChunk); ++i) {
      points_on(stretches[i], found[chunk].points);
      found[chunk].end.push_back(static_cast<uint32_t>(found[chunk].points.size()));
    }
  });
  std::vector<SeamPoint> points;
  double carried = 0;  // texels of stretches too short for a point of their own
  size_t kept = 0;
  for (size_t i = 0; i < stretches.size(); ++i) {
    const Found& chunk = found[i / kChunk];
    const uint32_t begin = i % kChunk ? chunk.end[i % kChunk - 1] : 0, end = chunk.end[i % kChunk];
    if (begin == end) continue;
    stretches[kept++] = stretches[i];
    for (uint32_t k = begin; k < end; ++k) {
      SeamPoint p = chunk.points[k];
      if (p.texels < kMinPoint) {
        carried += p.texels;
        if (carried < kMinPoint) continue;
        p.texels = carried;
        carried = 0;
      }
      points.push_back(p);
    }
  }
  stretches.resize(kept);
  return points;
}

const FoundSeams& SeamFinder::find(double angle_degrees) {
  const auto [it, is_new] = found_.try_emplace(angle_degrees);
  if (is_new) {
    const SeamSettings settings{.angle_degrees = angle_degrees};
    const std::vector<BorderEdge> edges = border_edges(scene_, atlas_);
    it->second.stretches = coincident_stretches(edges, settings);
    it->second.points = seam_points(edges, it->second.stretches, atlas_.contacts, settings);
  }
  return it->second;
}

}  // namespace kiln
