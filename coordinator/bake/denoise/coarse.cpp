// A Laplacian pyramid over surfaces (Burt & Adelson 1983), with the widest band filtered by regression and
// the detail of the others shrunk towards the part that replicates A and B share: with r the residual of a
// texel from the coarser level, the mean of r(A) r(B) is the square of the true detail, and the mean of
// ((r(A) + r(B)) / 2)^2 is detail plus noise.
#include "coordinator/bake/denoise/coarse.h"

#include <cmath>
#include <limits>

#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "coordinator/bake/denoise/bounds.h"
#include "coordinator/bake/denoise/dark.h"
#include "coordinator/bake/denoise/sums.h"
#include "coordinator/bake/neighbours/pieces.h"
#include "coordinator/bake/neighbours/surface_window.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxForTwo = 8, kMaxForOne = 24;  // samples of a replicate
// A texel that has this many times the samples of the middle one, and more than kMaxForOne, is not joined:
// its light would be lost among its neighbours', and more samples would not bring its stated error down.
constexpr uint32_t kAhead = 4;
constexpr uint32_t kMinPiece = 256;   // connected sites: texels of smaller pieces are not merged
constexpr float kJoinCosine = 0.97f;  // between normals of merged texels
constexpr double kDetailErrors = 1;   // standard errors that detail must exceed
// The same in units of the expected noise: with rare bright samples, all-dark texels look like detail, and
// their own products show no noise.
constexpr double kExpectedErrors = 2;
// A single sharp texel, as in choice.cpp: brighter, or dark in all of its samples.
constexpr double kAlone = 6, kAloneDark = 12, kFewAlone = 8;
constexpr size_t kMaxAround = 24;  // merged texels to interpolate between

struct Level {
  TexelStatistics statistics;
  SiteGeometry sites;
  SurfaceLinks links;
};

// By site: its parent on the coarser level; the members of each parent, ascending.
struct Joined {
  std::vector<uint32_t> of;
  std::vector<uint32_t> first, member;
  std::vector<uint8_t> is_joined;  // by site: on a surface whose texels are merged, and not ahead of others
  size_t count() const { return first.size() - 1; }
  std::span<const uint32_t> members(size_t i) const {
    return {member.data() + first[i], member.data() + first[i + 1]};
  }
};

bool same_square(const SiteGeometry& sites, uint32_t a, uint32_t b) {
  return sites.placement[a] == sites.placement[b] && sites.texel[a][0] / 2 == sites.texel[b][0] / 2 &&
         sites.texel[a][1] / 2 == sites.texel[b][1] / 2;
}

std::vector<uint8_t> on_large_pieces(const SurfaceLinks& links) {
  const size_t n = links.first.size() - 1;
  const std::vector<uint8_t> all(n, 1);
  const std::vector<uint32_t> pieces = surface_pieces(all, links);
  const std::vector<uint32_t> size = piece_sizes(pieces);
  std::vector<uint8_t> out(n);
  for (size_t i = 0; i < n; ++i) out[i] = size[pieces[i]] >= kMinPiece;
  return out;
}

// Replicate samples of the site in the middle; 0 without known sites.
uint32_t middle_samples(const TexelStatistics& s) {
  std::vector<uint32_t> samples;
  for (size_t i = 0; i < s.sites; ++i)
    if (s.known[i]) samples.push_back(s.samples[i]);
  if (samples.empty()) return 0;
  const auto middle = samples.begin() + static_cast<ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return *middle;
}

// By site: 1 where it has so many more samples than others that it is not joined.
std::vector<uint8_t> sites_ahead(const TexelStatistics& s) {
  const uint64_t most = std::max<uint64_t>(kMaxForOne, uint64_t{kAhead} * middle_samples(s));
  std::vector<uint8_t> out(s.sites);
  for (size_t i = 0; i < s.sites; ++i) out[i] = s.known[i] && s.samples[i] > most;
  return out;
}

// Groups linked sites of one 2 x 2 square on large surfaces, except those `ahead`.
Joined join(const SiteGeometry& sites, const SurfaceLinks& links, std::span<const uint8_t> ahead) {
  Joined out;
  out.is_joined = on_large_pieces(links);
  const auto n = static_cast<uint32_t>(sites.size());
  for (uint32_t i = 0; i < n; ++i)
    if (ahead[i]) out.is_joined[i] = 0;
  out.of.resize(n);
  for (uint32_t i = 0; i < n; ++i) {
    out.of[i] = i;
    if (!(sites.texel_size[i] > 0) || !out.is_joined[i]) continue;
    for (const uint32_t j : links.of(i)) {
      if (j >= i || !out.is_joined[j] || !same_square(sites, i, j) ||
          dot(sites.normal[i], sites.normal[j]) < kJoinCosine)
        continue;
      uint32_t a = i, b = j;  // four sites at most: chains are short
      while (out.of[a] != a) a = out.of[a];
      while (out.of[b] != b) b = out.of[b];
      out.of[std::max(a, b)] = std::min(a, b);
    }
  }
  uint32_t count = 0;
  std::vector<uint32_t> number(n);
  for (uint32_t i = 0; i < n; ++i) {
    uint32_t root = i;
    while (out.of[root] != root) root = out.of[root];
    number[i] = root == i ? count++ : number[root];
  }
  out.of = std::move(number);
  out.first.assign(size_t{count} + 1, 0);
  for (const uint32_t g : out.of) ++out.first[g + 1];
  for (size_t g = 0; g < count; ++g) out.first[g + 1] += out.first[g];
  out.member.resize(n);
  std::vector<uint32_t> next(out.first.begin(), out.first.end() - 1);
  for (uint32_t i = 0; i < n; ++i) out.member[next[out.of[i]]++] = i;
  return out;
}

SurfaceLinks joined_links(const SurfaceLinks& links, const Joined& joined, unsigned threads) {
  std::vector<std::vector<uint32_t>> of((joined.count() + kParallelRun - 1) / kParallelRun);
  SurfaceLinks out;
  out.first.assign(joined.count() + 1, 0);
  for_each_run(joined.count(), threads, [&](size_t begin, size_t end) {
    std::vector<uint32_t>& found = of[begin / kParallelRun];
    std::vector<uint32_t> own;
    for (size_t g = begin; g < end; ++g) {
      own.clear();
      for (const uint32_t i : joined.members(g))
        for (const uint32_t j : links.of(i))
          if (joined.of[j] != g) own.push_back(joined.of[j]);
      std::sort(own.begin(), own.end());
      own.erase(std::unique(own.begin(), own.end()), own.end());
      found.insert(found.end(), own.begin(), own.end());
      out.first[g + 1] = static_cast<uint32_t>(own.size());
    }
  });
  for (size_t g = 0; g < joined.count(); ++g) out.first[g + 1] += out.first[g];
  for (const std::vector<uint32_t>& found : of) out.link.insert(out.link.end(), found.begin(), found.end());
  return out;
}

SiteGeometry joined_sites(const SiteGeometry& sites, const Joined& joined, unsigned threads) {
  SiteGeometry out;
  const size_t n = joined.count();
  out.position.resize(n);
  out.normal.resize(n);
  out.texel_size.resize(n);
  out.placement.resize(n);
  out.texel.resize(n);
  for_each_index(n, threads, [&](size_t g) {
    const std::span<const uint32_t> members = joined.members(g);
    DVec3 position(0.0);
    Vec3 normal(0.0f);
    for (const uint32_t i : members) {
      position += DVec3(sites.position[i]);
      normal += sites.normal[i];
    }
    const uint32_t one = members[0];
    out.position[g] = Vec3(position / static_cast<double>(members.size()));
    out.normal[g] = normalize_or(normal, Vec3(0.0f));
    out.texel_size[g] = (joined.is_joined[one] ? 2 : 1) * sites.texel_size[one];
    out.placement[g] = sites.placement[one];
    out.texel[g] = {sites.texel[one][0] / 2, sites.texel[one][1] / 2};
  });
  return out;
}

bool is_number(const TexelStatistics& s, uint32_t i) {
  return std::isfinite(s.luminance[0][i]) && std::isfinite(s.luminance[1][i]);
}

// Means over the members that have samples.
TexelStatistics joined_statistics(const TexelStatistics& s, const Joined& joined, bool planes,
                                  unsigned threads) {
  TexelStatistics out;
  const size_t n = out.sites = joined.count();
  out.planes = planes ? s.planes : 0;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    out.mean[r] = ZeroedVector<float>(n * out.planes);
    out.luminance[r].assign(n, 0);
  }
  out.variance.assign(n, 0);
  if (!s.shared.empty()) out.shared.assign(n, 0);
  out.samples.assign(n, 0);
  out.known.assign(n, 0);
  for_each_index(n, threads, [&](size_t g) {
    uint32_t count = 0, samples = 0;
    double variance = 0;
    for (const uint32_t i : joined.members(g)) {
      if (!s.known[i] || s.samples[i] == 0 || !is_number(s, i)) continue;
      ++count;
      samples = std::min(samples + s.samples[i], 1u << 30);
      variance += double{s.variance[i]} / s.samples[i];
      if (!s.shared.empty()) out.shared[g] += s.shared[i];
      for (uint32_t r = 0; r < kReplicates; ++r) {
        out.luminance[r][g] += s.luminance[r][i];
        for (size_t p = 0; p < out.planes; ++p) out.mean[r][g * s.planes + p] += s.mean[r][i * s.planes + p];
      }
    }
    if (count == 0) return;
    const auto share = static_cast<float>(1.0 / count);
    for (uint32_t r = 0; r < kReplicates; ++r) {
      out.luminance[r][g] *= share;
      for (size_t p = 0; p < out.planes; ++p) out.mean[r][g * s.planes + p] *= share;
    }
    if (!s.shared.empty()) out.shared[g] *= share;
    out.variance[g] = static_cast<float>(variance * samples / (static_cast<double>(count) * count));
    out.samples[g] = samples;
    out.known[g] = 1;
  });
  return out;
}

// Interpolates the coarser level at the members of one of its sites.
class Interpolation {
 public:
  Interpolation(const SiteGeometry& sites, const SurfaceLinks& links, const std::vector<uint8_t>& has)
      : sites_(sites), links_(links), has_(has) {}

  void enter(uint32_t site) {
    count_ = 0;
    centre_ = sites_.position[site];
    size_ = sites_.texel_size[site];
    const Vec3 n = sites_.normal[site];
    frame_ = Frame(n);
    add(site, n);
    for (size_t ring = 0, begin = 0; ring < 2; ++ring) {
      const size_t end = count_;
      for (size_t i = begin; i < end; ++i)
        for (const uint32_t j : links_.of(around_[i])) add(j, n);
      begin = end;
    }
  }

  // Tent weights of one coarser texel's width: linear interpolation on a regular grid.
  size_t weights(const Vec3& at, std::array<float, kMaxAround>& out) const {
    double sum = 0;
    const Vec3 d = at - centre_;
    const double x = dot(d, frame_.x) / size_, y = dot(d, frame_.y) / size_;
    for (size_t k = 0; k < count_; ++k) {
      const double w = std::max(0.0, 1 - std::abs(x - x_[k])) * std::max(0.0, 1 - std::abs(y - y_[k]));
      out[k] = has_[around_[k]] ? static_cast<float>(w) : 0.0f;
      sum += double{out[k]};
    }
    if (!(sum > 0)) {
      out.fill(0);
      out[0] = 1;
      return 1;
    }
    for (size_t k = 0; k < count_; ++k) out[k] = static_cast<float>(out[k] / sum);
    return count_;
  }
  uint32_t site(size_t k) const { return around_[k]; }

 private:
  void add(uint32_t j, const Vec3& n) {
    if (count_ == kMaxAround || dot(sites_.normal[j], n) < SurfaceWindow::kMinCosine) return;
    for (size_t k = 0; k < count_; ++k)
      if (around_[k] == j) return;
    const Vec3 d = sites_.position[j] - centre_;
    if (count_ > 0 && dot(d, d) > 5.0f * size_ * size_) return;
    around_[count_] = j;
    x_[count_] = dot(d, frame_.x) / size_;
    y_[count_] = dot(d, frame_.y) / size_;
    ++count_;
  }

  const SiteGeometry& sites_;
  const SurfaceLinks& links_;
  const std::vector<uint8_t>& has_;
  Vec3 centre_{0.0f};
  Frame frame_{Vec3(0.0f, 0.0f, 1.0f)};
  double size_ = 1;
  size_t count_ = 0;
  std::array<uint32_t, kMaxAround> around_{};
  std::array<double, kMaxAround> x_{}, y_{};
};

// Sums of its members' luminance over one merged texel.
struct Detail {
  float product = 0, product_square = 0, square = 0, noise_square = 0;
  uint32_t count = 0;
};

class Refinement {
 public:
  Refinement(const Level& coarse, const Denoised& from, const TexelStatistics& s,
             std::span<const DirectionBound> bounds, const SiteGeometry& sites, const Joined& joined,
             unsigned threads)
      : coarse_(coarse),
        from_(from),
        s_(s),
        planes_(coarse.statistics.planes),
        bounds_(bounds),
        sites_(sites),
        joined_(joined),
        threads_(threads) {
    has_.resize(joined.count());
    for (size_t g = 0; g < has_.size(); ++g) has_[g] = coarse.statistics.known[g] || from.filled[g];
  }

  Denoised run() {
    out_.mean = ZeroedVector<float>(s_.sites * planes_);
    for (auto* v : {&out_.luminance, &out_.standard_error, &out_.raw_error, &out_.strength})
      v->assign(s_.sites, 0);
    out_.filled.assign(s_.sites, 0);
    detail_.resize(joined_.count());
    for_each_run(joined_.count(), threads_, [&](size_t begin, size_t end) {
      Interpolation between(coarse_.sites, coarse_.links, has_);
      for (size_t g = begin; g < end; ++g) take_coarse(static_cast<uint32_t>(g), between);
    });
    for_each_index(joined_.count(), threads_, [&](size_t g) { add_detail(static_cast<uint32_t>(g)); });
    return std::move(out_);
  }

 private:
  bool is_known(uint32_t i) const { return s_.known[i] && s_.samples[i] > 0 && is_number(s_, i); }

  void take_coarse(uint32_t g, Interpolation& between) {
    if (const uint32_t one = joined_.members(g)[0]; !joined_.is_joined[one]) {
      std::copy_n(from_.mean.data() + size_t{g} * planes_, planes_, out_.mean.data() + size_t{one} * planes_);
      out_.luminance[one] = from_.luminance[g];
      out_.standard_error[one] = from_.standard_error[g];
      out_.raw_error[one] = from_.raw_error[g];
      out_.strength[one] = from_.strength[g];
      out_.filled[one] = from_.filled[g];
      return;
    }
    if (!has_[g]) {
      for (const uint32_t i : joined_.members(g)) {
        take_own(i);
        if (s_.known[i] && !is_number(s_, i))
          out_.standard_error[i] = out_.raw_error[i] = std::numeric_limits<float>::infinity();
      }
      return;
    }
    between.enter(g);
    std::array<float, kMaxAround> weight;
    double sum = 0;
    for (const uint32_t i : joined_.members(g)) {
      float* out = out_.mean.data() + size_t{i} * planes_;
      const size_t count = between.weights(sites_.position[i], weight);
      double light = 0, error = 0, raw = 0;
      for (size_t k = 0; k < count; ++k) {
        const float w = weight[k];
        if (w == 0) continue;
        const uint32_t c = between.site(k);
        const float* in = from_.mean.data() + size_t{c} * planes_;
        for (size_t p = 0; p < planes_; ++p) out[p] += w * in[p];
        light += w * double{from_.luminance[c]};
        error += w * double{from_.standard_error[c]};
        // The noise of a coarser texel is that of its members' mean.
        raw += w * double{from_.raw_error[c]} * std::sqrt(static_cast<double>(joined_.members(c).size()));
      }
      out_.luminance[i] = static_cast<float>(light);
      out_.standard_error[i] = static_cast<float>(error);
      out_.raw_error[i] = static_cast<float>(raw);
      sum += light;
    }
    // Preserve the coarser texel's value as the mean of its members: interpolation deviates from it at
    // borders.
    const std::span<const uint32_t> members = joined_.members(g);
    const double mean = sum / static_cast<double>(members.size());
    const auto factor = static_cast<float>(mean > 0 ? std::clamp(from_.luminance[g] / mean, 0.5, 2.0) : 1.0);
    Detail detail;
    for (const uint32_t i : members) {
      out_.luminance[i] *= factor;
      for (size_t p = size_t{i} * planes_; p < (size_t{i} + 1) * planes_; ++p) out_.mean[p] *= factor;
      if (!is_known(i)) continue;
      const double light = out_.luminance[i], raw = out_.raw_error[i];
      const double a = s_.luminance[0][i] - light, b = s_.luminance[1][i] - light;
      const auto product = static_cast<float>(a * b), both = static_cast<float>(0.25 * (a + b) * (a + b));
      if (!std::isfinite(product) || !std::isfinite(both)) continue;
      detail.product += product;
      detail.product_square += product * product;
      detail.square += both;
      const auto noise = static_cast<float>(2 * raw * raw);  // for one replicate, of a product's deviation
      detail.noise_square += noise * noise;
      ++detail.count;
    }
    detail_[g] = detail;
  }

  void take_own(uint32_t i) {
    for (size_t p = size_t{i} * planes_; p < (size_t{i} + 1) * planes_; ++p)
      out_.mean[p] = 0.5f * s_.mean[0][p] + 0.5f * s_.mean[1][p];
    out_.luminance[i] = 0.5f * s_.luminance[0][i] + 0.5f * s_.luminance[1][i];
  }

  // How far a texel is trusted against its whole surroundings.
  double alone(uint32_t i) const {
    const double light = out_.luminance[i], raw = out_.raw_error[i];
    const double a = s_.luminance[0][i] - light, b = s_.luminance[1][i] - light, product = a * b;
    if (!(product > 0)) return 0;
    const double chance = (a < 0 ? kAloneDark : kAlone * (1 + kFewAlone / s_.samples[i])) * 2 * raw * raw;
    return std::max(0.0, 1 - chance / product);
  }

  void add_detail(uint32_t g) {
    if (!has_[g] || !joined_.is_joined[joined_.members(g)[0]]) return;
    Detail around = detail_[g];
    for (const uint32_t h : coarse_.links.of(g)) {
      around.product += detail_[h].product;
      around.product_square += detail_[h].product_square;
      around.square += detail_[h].square;
      around.noise_square += detail_[h].noise_square;
      around.count += detail_[h].count;
    }
    const auto sure_of = [&](double errors) {
      const double chance = std::max(std::sqrt(double{around.product_square}),
                                     kExpectedErrors * std::sqrt(double{around.noise_square}));
      return std::max(0.0, around.product - errors * chance);
    };
    const double sure = sure_of(kDetailErrors), half_sure = sure_of(0);
    const double share = around.square > 0 ? std::min(1.0, sure / double{around.square}) : 0.0;
    const double left = around.count > 0 ? (1 - share) * (1 - share) * half_sure / around.count : 0.0;
    const double noise =
        around.count > 0 ? std::max(0.0, double{around.square} - half_sure) / around.count : 0.0;
    for (const uint32_t i : joined_.members(g)) {
      const double coarse = out_.standard_error[i];
      if (s_.known[i] && !is_number(s_, i)) {
        take_own(i);
        out_.standard_error[i] = out_.raw_error[i] = std::numeric_limits<float>::infinity();
        continue;
      }
      if (!is_known(i)) {
        out_.filled[i] = s_.samples[i] == 0 && !s_.known[i] && sites_.texel_size[i] > 0;
        out_.strength[i] = 1;
        out_.standard_error[i] = static_cast<float>(std::sqrt(coarse * coarse + detail_of(around)));
        continue;
      }
      float* out = out_.mean.data() + size_t{i} * planes_;
      const double own_share = std::max(share, alone(i));
      const auto keep = static_cast<float>(own_share);
      const float* a = s_.mean[0].data() + size_t{i} * planes_;
      const float* b = s_.mean[1].data() + size_t{i} * planes_;
      if (keep > 0)
        for (size_t p = 0; p < planes_; ++p) out[p] += keep * (0.5f * a[p] + 0.5f * b[p] - out[p]);
      hold_bounds(bounds_, out, planes_);
      const double own = 0.5 * (double{s_.luminance[0][i]} + s_.luminance[1][i]);
      out_.luminance[i] =
          static_cast<float>(std::max(0.0, out_.luminance[i] + own_share * (own - out_.luminance[i])));
      out_.standard_error[i] = static_cast<float>(
          std::sqrt((1 - own_share) * coarse * coarse + left + own_share * own_share * noise));
      out_.strength[i] = 1 - keep;
    }
  }
  // Mean square of true detail.
  static double detail_of(const Detail& d) {
    return d.count > 0 ? std::max(0.0, double{d.product}) / d.count : 0.0;
  }

  const Level& coarse_;
  const Denoised& from_;
  const TexelStatistics& s_;
  const size_t planes_;  // filtered planes: those of `s`, or none
  std::span<const DirectionBound> bounds_;
  const SiteGeometry& sites_;
  const Joined& joined_;
  unsigned threads_;
  std::vector<uint8_t> has_;
  std::vector<Detail> detail_;
  Denoised out_;
};

Denoised run(const TexelStatistics& statistics, std::span<const DirectionBound> bounds, bool planes,
             const SiteGeometry& sites, const SurfaceLinks& links, std::span<const uint8_t> ahead,
             uint32_t levels, unsigned threads, KeptFilters* filters) {
  if (levels == 0)
    return planes ? denoise(statistics, bounds, sites, links, threads, filters)
                  : denoise_luminance(statistics, sites, links, threads, filters);
  const Joined joined = join(sites, links, ahead);
  const Level coarse{joined_statistics(statistics, joined, planes, threads),
                     joined_sites(sites, joined, threads), joined_links(links, joined, threads)};
  std::vector<uint8_t> coarse_ahead(joined.count());  // those are alone in their group
  for (size_t g = 0; g < coarse_ahead.size(); ++g) coarse_ahead[g] = ahead[joined.members(g)[0]];
  const Denoised from = run(coarse.statistics, bounds, planes, coarse.sites, coarse.links, coarse_ahead,
                            levels - 1, threads, filters);
  return Refinement(coarse, from, statistics, bounds, sites, joined, threads).run();
}

Denoised run_parted(const TexelStatistics& statistics, std::span<const DirectionBound> bounds, bool planes,
                    const SiteGeometry& sites, const SurfaceLinks& links, uint32_t levels, unsigned threads,
                    KeptFilters* filters) {
  const SurfaceLinks parted = part_dark(statistics, sites, links, threads);
  const std::vector<uint8_t> ahead = levels > 0 ? sites_ahead(statistics) : std::vector<uint8_t>{};
  Denoised out = run(statistics, bounds, planes, sites, parted, ahead, levels, threads, filters);
  if (levels > 0) restore_sums(statistics, parted, out);
  return out;
}

}  // namespace

double share_of_large_pieces(const SurfaceLinks& links) {
  const std::vector<uint8_t> on = on_large_pieces(links);
  return on.empty()
             ? 1
             : static_cast<double>(std::count(on.begin(), on.end(), 1)) / static_cast<double>(on.size());
}

uint32_t denoise_levels(const TexelStatistics& statistics) {
  const uint32_t middle = middle_samples(statistics);
  return middle == 0 ? 0 : middle <= kMaxForTwo ? 2 : middle <= kMaxForOne ? 1 : 0;
}

Denoised denoise_joined(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                        const SiteGeometry& sites, const SurfaceLinks& links, uint32_t levels,
                        unsigned threads, KeptFilters* filters) {
  return run_parted(statistics, bounds, true, sites, links, levels, threads, filters);
}

Denoised denoise_joined_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                                  const SurfaceLinks& links, uint32_t levels, unsigned threads,
                                  KeptFilters* filters) {
  return run_parted(statistics, {}, false, sites, links, levels, threads, filters);
}

}  // namespace kiln
