#include "coordinator/bake/neighbours/views.h"

#include <algorithm>
#include <cmath>

#include "common/base/clock.h"
#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/pieces.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {
namespace {

constexpr size_t kDirections = 8;
constexpr float kMinCosine = 0.2f;  // minimum cosine between a traced direction and the normal
constexpr float kFar = 32;          // texels: everything further away counts as equal
constexpr float kApart = 2.5;       // distances that differ by this factor belong to different surfaces
constexpr float kNear = 8;          // texels: both further away count as open
constexpr float kAlike = 1.25f;
constexpr float kStep = 0.5;    // texels: a difference from one step towards a wall is not another surface
constexpr float kLift = 1e-3f;  // texels off the surface

// The corners of a cube, rotated so that none is parallel to a model's axis.
std::array<Vec3, kDirections> directions() {
  // Rotation by the integer quaternion (5, 2, 3, 1).
  const float w = 5, x = 2, y = 3, z = 1, n = std::sqrt(3.0f) * (w * w + x * x + y * y + z * z);
  std::array<Vec3, kDirections> out;
  for (size_t i = 0; i < kDirections; ++i) {
    const Vec3 v(i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f);
    out[i] =
        Vec3((w * w + x * x - y * y - z * z) * v.x + 2 * (x * y - w * z) * v.y + 2 * (x * z + w * y) * v.z,
             2 * (x * y + w * z) * v.x + (w * w - x * x + y * y - z * z) * v.y + 2 * (y * z - w * x) * v.z,
             2 * (x * z - w * y) * v.x + 2 * (y * z + w * x) * v.y + (w * w - x * x - y * y + z * z) * v.z) /
        n;
  }
  return out;
}

// Distance in texels to the first surface, by direction; 0: not traced; negative: hit a back face.
using View = std::array<float, kDirections>;

bool differ(const View& a, const View& b) {
  int asked = 0, other = 0;
  for (size_t k = 0; k < kDirections; ++k) {
    if (a[k] == 0 || b[k] == 0) continue;
    ++asked;
    const float near = std::min(std::abs(a[k]), std::abs(b[k])),
                far = std::max(std::abs(a[k]), std::abs(b[k]));
    other += (near < kNear && near * kApart + kStep < far) || (a[k] < 0) != (b[k] < 0);
  }
  return asked > 0 && 2 * other >= asked;
}

// For links that the surface lacks: the same view in every direction that can be compared.
bool agree(const View& a, const View& b) {
  int asked = 0;
  for (size_t k = 0; k < kDirections; ++k) {
    if (a[k] == 0 || b[k] == 0) continue;
    ++asked;
    const float near = std::min(std::abs(a[k]), std::abs(b[k])),
                far = std::max(std::abs(a[k]), std::abs(b[k]));
    if (near * kAlike < far || (a[k] < 0) != (b[k] < 0)) return false;
  }
  return asked >= 3;
}

// Sites of small pieces in a grid whose cells scale with their texels.
class SmallPieces {
 public:
  SmallPieces(const SiteGeometry& sites, const SurfaceLinks& links, const std::vector<View>& views)
      : sites_(sites), views_(views) {
    const std::vector<uint8_t> all(sites.size(), 1);
    piece_ = surface_pieces(all, links);
    const std::vector<uint32_t> size = piece_sizes(piece_);
    for (uint32_t i = 0; i < sites.size(); ++i)
      if (size[piece_[i]] < kSmallPiece && sites.texel_size[i] > 0) {
        small_.push_back(i);
        places_.push_back({key(level_of(i), cell_of(sites.position[i], level_of(i))), i});
      }
    std::sort(places_.begin(), places_.end());
  }

  const std::vector<uint32_t>& sites() const { return small_; }

  // The nearest sites of other pieces that may be linked with site i, at most kMaxAdded.
  void beside(uint32_t i, std::vector<uint32_t>& out) const {
    struct Found {
      float square;
      uint32_t site;
      auto operator<=>(const Found&) const = default;
    };
    std::array<Found, kMaxAdded> best;
    size_t count = 0;
    for (int level = level_of(i) - 1; level <= level_of(i) + 1; ++level) {
      const Cell at = cell_of(sites_.position[i], level);
      for (int k = 0; k < 27; ++k) {
        const uint64_t cell = key(level, {at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1});
        for (auto p = std::lower_bound(places_.begin(), places_.end(), Place{cell, 0});
             p != places_.end() && p->cell == cell; ++p) {
          if (!may_link(i, p->site)) continue;
          const Vec3 d = sites_.position[p->site] - sites_.position[i];
          Found found{dot(d, d), p->site};
          for (size_t b = 0; b < count; ++b)
            if (found < best[b]) std::swap(found, best[b]);
          if (count < best.size()) best[count++] = found;
        }
      }
    }
    for (size_t b = 0; b < count; ++b) out.push_back(best[b].site);
  }

 private:
  static constexpr uint32_t kSmallPiece = 64;  // sites
  static constexpr size_t kMaxAdded = 4;
  static constexpr float kBeside = 2.5f;  // texels between them
  static constexpr float kOffPlane = 0.5f;
  static constexpr float kSameWay = 0.97f;  // cosine of the normals
  using Cell = std::array<int64_t, 3>;
  struct Place {
    uint64_t cell;
    uint32_t site;
    auto operator<=>(const Place&) const = default;
  };

  int level_of(uint32_t i) const { return std::ilogb(sites_.texel_size[i]); }
  static Cell cell_of(const Vec3& p, int level) {
    const double size = kBeside * std::ldexp(2.0, level);
    Cell c;
    for (int axis = 0; axis < 3; ++axis)
      c[axis] = static_cast<int64_t>(std::floor(std::clamp(double{p[axis]} / size, -0x1p40, 0x1p40)));
    return c;
  }
  static uint64_t key(int level, const Cell& cell) {
    uint64_t hash = static_cast<uint64_t>(level + 2000);
    for (const int64_t k : cell) {
      hash = (hash ^ static_cast<uint64_t>(k)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 32;
    }
    return hash;
  }
  bool may_link(uint32_t a, uint32_t b) const {
    if (piece_[a] == piece_[b]) return false;
    const float size = std::min(sites_.texel_size[a], sites_.texel_size[b]);
    if (std::max(sites_.texel_size[a], sites_.texel_size[b]) > 2 * size) return false;
    const Vec3 d = sites_.position[b] - sites_.position[a];
    return dot(d, d) <= kBeside * kBeside * size * size &&
           dot(sites_.normal[a], sites_.normal[b]) >= kSameWay &&
           std::abs(dot(d, sites_.normal[a])) <= kOffPlane * size && agree(views_[a], views_[b]);
  }

  const SiteGeometry& sites_;
  const std::vector<View>& views_;
  std::vector<uint32_t> piece_, small_;
  std::vector<Place> places_;
};

// Merges the links of `added` (already in both directions) with the others.
void add_links(const std::vector<std::pair<uint32_t, uint32_t>>& added, size_t sites, SurfaceLinks& links) {
  SurfaceLinks out;
  out.first.assign(sites + 1, 0);
  out.link.reserve(links.link.size() + added.size());
  size_t next = 0;
  for (uint32_t i = 0; i < sites; ++i) {
    const size_t begin = out.link.size();
    const std::span<const uint32_t> own = links.of(i);
    out.link.insert(out.link.end(), own.begin(), own.end());
    for (; next < added.size() && added[next].first == i; ++next) out.link.push_back(added[next].second);
    std::sort(out.link.begin() + static_cast<ptrdiff_t>(begin), out.link.end());
    out.first[i + 1] = static_cast<uint32_t>(out.link.size());
  }
  links = std::move(out);
}

}  // namespace

std::optional<ViewLinks> link_by_view(const Scene& scene, const SiteGeometry& sites, unsigned threads,
                                      double most_seconds, SurfaceLinks& links) {
  const Stopwatch watch;
  const SceneRays rays(scene, threads);
  const std::array<Vec3, kDirections> ask = directions();
  const size_t n = sites.size(), runs = (n + kParallelRun - 1) / kParallelRun;
  std::vector<View> views(n);
  const auto look = [&](size_t run) {
    for (size_t i = run * kParallelRun; i < std::min(n, (run + 1) * kParallelRun); ++i) {
      const float size = sites.texel_size[i];
      if (!(size > 0)) continue;
      const Vec3 normal = sites.normal[i], from = sites.position[i] + normal * (kLift * size);
      for (size_t k = 0; k < kDirections; ++k) {
        if (dot(normal, ask[k]) < kMinCosine) continue;
        RayHit hit;
        views[i][k] = rays.closest(from, ask[k], kFar * size, hit)
                          ? std::max(hit.distance / size, 1e-6f) * (hit.back ? -1.0f : 1.0f)
                          : kFar;
      }
    }
  };
  if (!parallel_for_within(most_seconds - watch.seconds(), runs, look, threads)) return std::nullopt;
  std::vector<uint8_t> keeps(links.link.size());
  for_each_index(n, threads, [&](size_t i) {
    for (uint32_t l = links.first[i]; l < links.first[i + 1]; ++l)
      keeps[l] = !differ(views[i], views[links.link[l]]);
  });
  uint32_t kept = 0;
  size_t taken = 0;
  for (size_t i = 0, begin = 0; i < n; ++i) {
    const uint32_t end = links.first[i + 1];
    for (size_t l = begin; l < end; ++l)
      if (keeps[l])
        links.link[kept++] = links.link[l];
      else
        ++taken;
    begin = end;
    links.first[i + 1] = kept;
  }
  links.link.resize(kept);

  const SmallPieces pieces(sites, links, views);
  const std::vector<uint32_t>& small = pieces.sites();
  std::vector<std::vector<std::pair<uint32_t, uint32_t>>> found((small.size() + kParallelRun - 1) /
                                                                kParallelRun);
  for_each_run(small.size(), threads, [&](size_t begin, size_t end) {
    std::vector<uint32_t> beside;
    for (size_t i = begin; i < end; ++i) {
      beside.clear();
      pieces.beside(small[i], beside);
      for (const uint32_t j : beside) {
        found[begin / kParallelRun].push_back({small[i], j});
        found[begin / kParallelRun].push_back({j, small[i]});
      }
    }
  });
  std::vector<std::pair<uint32_t, uint32_t>> added;
  for (const auto& some : found) added.insert(added.end(), some.begin(), some.end());
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  if (!added.empty()) add_links(added, n, links);
  return ViewLinks{taken / 2, added.size() / 2};
}

}  // namespace kiln
