#include "coordinator/bake/neighbours/surface_links.h"

#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/contact_walls.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {
namespace {

constexpr size_t kRun = 4096;
constexpr uint32_t kNone = ~0u;
constexpr float kLinkCosine = 2 * kWindowCosine * kWindowCosine - 1;  // twice the angle
constexpr double kWidestGap = 2.5;  // texels: sites of partly covered texels are off centre

struct Link {
  uint32_t a, b;
  auto operator<=>(const Link&) const = default;
};

class Linker {
 public:
  Linker(SeamFinder& seams, const SiteGeometry& sites, unsigned threads)
      : seams_(seams), atlas_(seams.atlas()), sites_(sites), threads_(threads), walls_(atlas_.contacts) {
    site_of_texel_.assign(atlas_.texel_count(), kNone);
    for (uint32_t s = 0; s < sites.size(); ++s) site_of_texel_[atlas_.sites.texel[s]] = s;
  }

  std::vector<Link> run() const {
    std::vector<Link> links = inside_charts();
    const std::vector<Link> seams = across_seams();
    links.insert(links.end(), seams.begin(), seams.end());
    return links;
  }

 private:
  bool joined(uint32_t a, uint32_t b) const {
    if (!sizes_alike(sites_.texel_size[a], sites_.texel_size[b])) return false;
    if (dot(sites_.normal[a], sites_.normal[b]) < kLinkCosine) return false;
    const DVec3 pa(sites_.position[a]), pb(sites_.position[b]);
    const double size = std::max(sites_.texel_size[a], sites_.texel_size[b]);
    if (!(length(pa - pb) <= kWidestGap * size)) return false;
    if (walls_.empty()) return true;
    return !walls_.between(pa, pb, DVec3(sites_.normal[a]), size);
  }

  std::vector<Link> inside_charts() const {
    std::vector<std::vector<Link>> found((sites_.size() + kRun - 1) / kRun);
    const auto visit = [&](size_t run) {
      const size_t end = std::min(sites_.size(), (run + 1) * kRun);
      for (size_t s = run * kRun; s < end; ++s) {
        const auto a = static_cast<uint32_t>(s);
        const uint32_t texel = atlas_.sites.texel[a], in_page = texel % (atlas_.width * atlas_.height);
        if (in_page % atlas_.width + 1 < atlas_.width) add(a, site_of_texel_[texel + 1], found[run]);
        if (in_page / atlas_.width + 1 < atlas_.height)
          add(a, site_of_texel_[texel + atlas_.width], found[run]);
      }
    };
    parallel_for(found.size(), visit, threads_);
    std::vector<Link> links;
    links.reserve(2 * sites_.size());
    for (const std::vector<Link>& some : found) links.insert(links.end(), some.begin(), some.end());
    return links;
  }

  void add(uint32_t a, uint32_t b, std::vector<Link>& links) const {
    if (b != kNone && sites_.placement[a] == sites_.placement[b] && joined(a, b)) links.push_back({a, b});
  }

  std::vector<Link> across_seams() const {
    std::vector<Link> links;
    for (const SeamPoint& p : seams_.find().points) {
      const uint32_t a = site_beside(p, 0), b = site_beside(p, 1);
      if (a != kNone && b != kNone && a != b && joined(a, b)) links.push_back({a, b});
    }
    return links;
  }

  // The nearest of the four texels read by a lookup on this side of the seam that has a site on this side's
  // chart.
  uint32_t site_beside(const SeamPoint& p, int side) const {
    const DVec2 at = p.texel[side], low = glm::floor(at - 0.5);
    uint32_t best = kNone;
    double best_square = 1e30;
    for (int k = 0; k < 4; ++k) {
      const DVec2 texel = low + DVec2(k & 1, k >> 1), off = texel + 0.5 - at;
      if (texel.x < 0 || texel.y < 0 || texel.x >= atlas_.width || texel.y >= atlas_.height) continue;
      const uint32_t s =
          site_of_texel_[(size_t{p.page[side]} * atlas_.height + size_t(texel.y)) * atlas_.width +
                         size_t(texel.x)];
      if (s == kNone || sites_.placement[s] != p.placement[side] || !(dot(off, off) < best_square)) continue;
      best = s;
      best_square = dot(off, off);
    }
    return best;
  }

  SeamFinder& seams_;
  const Atlas& atlas_;
  const SiteGeometry& sites_;
  unsigned threads_;
  ContactWalls walls_;
  std::vector<uint32_t> site_of_texel_;
};

}  // namespace

SurfaceLinks surface_links(const Scene& scene, const Atlas& atlas, const SiteGeometry& sites,
                           unsigned threads) {
  SeamFinder seams(scene, atlas);
  return surface_links(seams, sites, threads);
}

SurfaceLinks surface_links(SeamFinder& seams, const SiteGeometry& sites, unsigned threads) {
  const std::vector<Link> links = Linker(seams, sites, threads).run();
  SurfaceLinks out;
  out.first.assign(sites.size() + 1, 0);
  for (const Link& l : links) ++out.first[l.a + 1], ++out.first[l.b + 1];
  for (size_t s = 0; s < sites.size(); ++s) out.first[s + 1] += out.first[s];
  out.link.resize(out.first.back());
  std::vector<uint32_t> next(out.first.begin(), out.first.end() - 1);
  for (const Link& l : links) {
    out.link[next[l.a]++] = l.b;
    out.link[next[l.b]++] = l.a;
  }
  // Sort and remove duplicates: seams yield a pair once per point.
  uint32_t kept = 0;
  for (size_t s = 0; s < sites.size(); ++s) {
    const auto begin = out.link.begin() + out.first[s], end = out.link.begin() + next[s];
    std::sort(begin, end);
    const auto last = std::unique(begin, end);
    out.first[s] = kept;
    kept += static_cast<uint32_t>(std::copy(begin, last, out.link.begin() + kept) - out.link.begin()) - kept;
  }
  out.first[sites.size()] = kept;
  out.link.resize(kept);
  return out;
}

}  // namespace kiln
