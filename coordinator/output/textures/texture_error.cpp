#include "coordinator/output/textures/texture_error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/math/trig.h"

namespace kiln {
namespace {

constexpr size_t kMaxPlanes = 3 * kMaxBasisFunctions;
constexpr double kLogFloor = 1.0 / 1024;

// E at m, of a surface of normal n, from planes: the functions of a basis, or E itself.
Vec3 light(const float* planes, const BasisInfo* basis, const Vec3& n, const Vec3& m) {
  if (!basis) return {planes[0], planes[1], planes[2]};
  Vec3 e;
  float f[kMaxBasisFunctions];
  for (int c = 0; c < 3; ++c) {
    for (size_t k = 0; k < basis->functions.size(); ++k) f[k] = planes[3 * k + c];
    e[c] = basis->irradiance(f, n, m);
  }
  return e;
}

// Normals 15, 35 and 60 degrees off the z axis.
const std::array<std::array<Vec3, 4>, 3> kTurned = [] {
  std::array<std::array<Vec3, 4>, 3> out;
  constexpr float kSine[] = {0.258819045f, 0.573576436f, 0.866025404f};
  for (int k = 0; k < 3; ++k) {
    const float s = kSine[k], c = std::sqrt(1 - s * s);
    out[k] = {Vec3(s, 0, c), Vec3(0, s, c), Vec3(-s, 0, c), Vec3(0, -s, c)};
  }
  return out;
}();

struct Sums {
  double texels = 0, between = 0, filter = 0, log = 0;
  uint64_t texel_count = 0, between_count = 0, log_count = 0;
  double low = 1e300, high = -1e300;  // of the logarithm
  struct AtNormal {
    double signed_error = 0, squares = 0;
    uint64_t count = 0;
    void add(const AtNormal& o) { signed_error += o.signed_error, squares += o.squares, count += o.count; }
  };
  AtNormal at_normal[4], format;

  void add(const Sums& o) {
    for (int k = 0; k < 4; ++k) at_normal[k].add(o.at_normal[k]);
    format.add(o.format);
    texels += o.texels, between += o.between, filter += o.filter, log += o.log;
    texel_count += o.texel_count, between_count += o.between_count, log_count += o.log_count;
    low = std::min(low, o.low), high = std::max(high, o.high);
  }
};

class Meter {
 public:
  Meter(const MapLevel& level, const BasisInfo* basis, std::span<const Vec3> normals,
        std::span<const DecodedTexture> textures, std::span<const DecodedTexture> exact)
      : level_(level),
        basis_(basis),
        normals_(normals),
        textures_(textures),
        exact_(exact),
        normal_count_(basis ? kErrorNormals : 1) {
    for (const char* plane : {"E.R", "E.G", "E.B"}) irradiance_.push_back(&level.planes.plane(plane));
    for (const DecodedTexture& t : textures)
      for (const std::string& plane : t.layout->plane) master_.push_back(&level.planes.plane(plane));
    mean_ = map_mean();
  }

  struct PlaceError {
    double decoded = 0, exact = 0;  // relative mean square
  };

  // At the mean of up to four texels; `normal` of the first.
  PlaceError at(std::span<const size_t> texel, Sums& sums) const {
    static constexpr float kQuarter[4] = {0.25f, 0.25f, 0.25f, 0.25f}, kOne[1] = {1};
    const std::span<const float> weight = texel.size() == 4 ? std::span<const float>(kQuarter) : kOne;
    float truth[kMaxPlanes] = {}, got[kMaxPlanes], plain[kMaxPlanes];
    for (size_t p = 0; p < master_.size(); ++p)
      for (size_t i = 0; i < texel.size(); ++i) truth[p] += weight[i] * (*master_[p])[texel[i]];
    lookup_planes(textures_, texel, weight, got);
    const bool filtered = texel.size() == 4;
    if (filtered) lookup_planes(exact_, texel, weight, plain);
    Vec3 n[kErrorNormals] = {Vec3(0.0f)};
    const Vec3 own = basis_ ? normals_[texel[0]] : n[0];
    if (basis_) hemisphere_normals(own, n);
    std::array<Vec3, kErrorNormals> e;
    double mean = 0, squares = 0, plain_squares = 0;
    for (int k = 0; k < normal_count_; ++k) {
      e[k] = light(truth, basis_, own, n[k]);
      const Vec3 d = light(got, basis_, own, n[k]) - e[k];
      squares += double{dot(d, d)} / 3;
      mean += luminance(e[k]);
      if (filtered) {
        const Vec3 f = light(plain, basis_, own, n[k]) - e[k];
        plain_squares += double{dot(f, f)} / 3;
      }
      if (mean_ > 0) {
        const double a = logarithm(e[k]), b = logarithm(e[k] + d);
        sums.log += (a - b) * (a - b);
        sums.low = std::min(sums.low, a), sums.high = std::max(sums.high, a);
        ++sums.log_count;
      }
    }
    add_at_normals(texel, weight, truth, got, sums);
    mean /= normal_count_;
    const double by = (mean * mean + 1e-4 * mean_ * mean_) * normal_count_;
    if (!(by > 0)) return {};
    return {squares / by, plain_squares / by};
  }

  bool counts(size_t t) const {
    return level_.owner[t] != 0 && level_.weight[t] == 1 && (!basis_ || normals_[t] != Vec3(0.0f));
  }
  // Texels t, right, below and diagonal, if all are on one chart.
  bool square(size_t t, std::array<size_t, 4>& four) const {
    const size_t width = level_.planes.width, x = t % width, y = t / width % level_.page_height;
    if (x + 1 >= width || y + 1 >= level_.page_height) return false;
    four = {t, t + 1, t + width, t + width + 1};
    for (const size_t n : four)
      if (level_.owner[n] != level_.owner[t] || !counts(n)) return false;
    return true;
  }

 private:
  // Relative to `e`, E at the own normal there, and a hundredth of the map's mean.
  void add_at_normal(const Vec3& e, const Vec3& d, Sums::AtNormal& sum) const {
    const double by = std::pow(double{luminance(e)}, 2) + 1e-4 * mean_ * mean_;
    if (!(by > 0)) return;
    sum.signed_error += luminance(d) / std::sqrt(by);
    sum.squares += double{dot(d, d)} / (3 * by);
    ++sum.count;
  }

  // `truth`, `got`: planes at the mean of those texels.
  void add_at_normals(std::span<const size_t> texel, std::span<const float> weight, const float* truth,
                      const float* got, Sums& sums) const {
    Vec3 e(0.0f), normal(0.0f);
    for (size_t i = 0; i < texel.size(); ++i) {
      for (int c = 0; c < 3; ++c) e[c] += weight[i] * (*irradiance_[c])[texel[i]];
      if (basis_) normal += normals_[texel[i]];
    }
    if (basis_) normal = normalize_or(normal, normals_[texel[0]]);
    const Vec3 shown = light(got, basis_, normal, normal);
    add_at_normal(e, shown - e, sums.at_normal[0]);
    add_at_normal(e, shown - light(truth, basis_, normal, normal), sums.format);
    if (!basis_) return;
    const Frame frame(normal);
    for (int k = 1; k < 4; ++k)
      for (int way = 0; way < 4; ++way) {
        const Vec3 n = frame.to_world(kTurned[k - 1][way]);
        add_at_normal(e, light(got, basis_, normal, n) - light(truth, basis_, normal, n), sums.at_normal[k]);
      }
  }

  double logarithm(const Vec3& e) const {
    return std::log2(std::max(0.0, double{luminance(e)}) + kLogFloor * mean_);
  }
  // Mean luminance of E.
  double map_mean() const {
    double sum = 0;
    uint64_t count = 0;
    for (size_t t = 0; t < level_.owner.size(); ++t) {
      if (!counts(t)) continue;
      sum += luminance(Vec3((*irradiance_[0])[t], (*irradiance_[1])[t], (*irradiance_[2])[t]));
      ++count;
    }
    return count ? sum / static_cast<double>(count) : 0;
  }

  const MapLevel& level_;
  const BasisInfo* basis_;
  std::span<const Vec3> normals_;
  std::span<const DecodedTexture> textures_, exact_;
  const int normal_count_;
  std::vector<const std::vector<float>*> master_, irradiance_;
  double mean_ = 0;
};

// Four rows of one page: whole blocks.
struct Strip {
  Sums sums;
  TextureError::Place worst_block, worst_texel;
};

Strip measure_strip(const MapLevel& level, const Meter& meter, uint32_t page, uint32_t top,
                    std::vector<float>* picture) {
  Strip strip;
  const uint32_t width = level.planes.width, bottom = std::min(top + 4, level.page_height);
  std::vector<double> block((width + 3) / 4, 0);
  std::vector<uint32_t> in_block(block.size(), 0);
  for (uint32_t y = top; y < bottom; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const size_t t = page * level.page_texels() + size_t{y} * width + x;
      if (!meter.counts(t)) continue;
      const size_t one[1] = {t};
      const double error = meter.at(one, strip.sums).decoded;
      strip.sums.texels += error;
      ++strip.sums.texel_count;
      block[x / 4] += error;
      ++in_block[x / 4];
      const double rms = std::sqrt(error);
      if (picture) (*picture)[t] = static_cast<float>(rms);
      if (rms > strip.worst_texel.error) strip.worst_texel = {page, x, y, rms};
      std::array<size_t, 4> four{};
      if (!meter.square(t, four)) continue;
      const Meter::PlaceError between = meter.at(four, strip.sums);
      strip.sums.between += between.decoded;
      strip.sums.filter += between.exact;
      ++strip.sums.between_count;
    }
  for (size_t b = 0; b < block.size(); ++b) {
    const double rms = in_block[b] ? std::sqrt(block[b] / in_block[b]) : 0;
    if (rms > strip.worst_block.error) strip.worst_block = {page, static_cast<uint32_t>(4 * b), top, rms};
  }
  return strip;
}

double share(double sum, uint64_t count) {
  return count ? sum / static_cast<double>(count) : 0;
}

}  // namespace

double TextureError::relative_rms() const {
  return std::sqrt(rel_mse);
}

void hemisphere_normals(const Vec3& normal, Vec3 out[kErrorNormals]) {
  static const auto kSet = [] {
    std::array<Vec3, kErrorNormals> set;
    constexpr float kGoldenAngle = 2.39996323f;
    for (int i = 0; i < kErrorNormals; ++i) {
      const float z = 1 - (static_cast<float>(i) + 0.5f) / kErrorNormals, r = std::sqrt(1 - z * z);
      const float phi = kGoldenAngle * static_cast<float>(i);
      set[i] = Vec3(r * std::cos(phi), r * std::sin(phi), z);
    }
    return set;
  }();
  const Frame frame(normal);
  for (int i = 0; i < kErrorNormals; ++i) out[i] = frame.to_world(kSet[i]);
}

TextureError measure_texture_error(const MapLevel& level, const BasisInfo* basis,
                                   std::span<const Vec3> normals, std::span<const DecodedTexture> textures,
                                   std::span<const DecodedTexture> exact, std::vector<float>* picture,
                                   uint32_t every) {
  if (picture) picture->assign(level.owner.size(), 0);
  const Meter meter(level, basis, normals, textures, exact);
  const uint32_t rows = (level.page_height + 3) / 4;
  std::vector<Strip> strips(size_t{rows} * level.pages);
  parallel_for(strips.size(), [&](size_t i) {
    if (i % every != 0) return;
    strips[i] = measure_strip(level, meter, static_cast<uint32_t>(i / rows),
                              static_cast<uint32_t>(i % rows * 4), picture);
  });
  Sums s;
  TextureError out;
  for (const Strip& strip : strips) {
    s.add(strip.sums);
    if (strip.worst_block.error > out.worst_block.error) out.worst_block = strip.worst_block;
    if (strip.worst_texel.error > out.worst_texel.error) out.worst_texel = strip.worst_texel;
  }
  for (int k = 0; k < 4; ++k) {
    out.at_normal[k].bias = share(s.at_normal[k].signed_error, s.at_normal[k].count);
    out.at_normal[k].rms = std::sqrt(share(s.at_normal[k].squares, s.at_normal[k].count));
  }
  out.format = std::sqrt(share(s.format.squares, s.format.count));
  out.texels = s.texel_count;
  out.between = s.between_count;
  out.rel_mse = share(s.texels + s.between, s.texel_count + s.between_count);
  out.rel_mse_texels = share(s.texels, s.texel_count);
  out.rel_mse_between = share(s.between, s.between_count);
  out.rel_mse_filter = share(s.filter, s.between_count);
  const double log_rms = std::sqrt(share(s.log, s.log_count));
  // Equal images have an infinite ratio: 200 dB is beyond float precision.
  out.psnr_log =
      log_rms > 0 && s.high > s.low ? std::min(200.0, 20 * std::log10((s.high - s.low) / log_rms)) : 200;
  return out;
}

}  // namespace kiln
