#include "coordinator/bake/denoise/kernel.h"

#include <cmath>

#include "common/math/frame.h"

namespace kiln {
namespace {

// Regularisation of the (co)variance of terms, relative to powers of the bandwidth: sites in one row
// determine no slope across it.
constexpr double kMinSpread = 1e-6;

constexpr int kTerms = 6;  // 1, x, y, x^2, x y, y^2

// First column of the inverse of a symmetric positive matrix whose lower triangle is given; Cholesky in
// place.
void solve_first(double (&m)[kTerms][kTerms], double (&c)[kTerms]) {
  const double least = 1e-12 * m[0][0];
  for (int a = 0; a < kTerms; ++a)
    for (int b = 0; b <= a; ++b) {
      double sum = m[a][b];
      for (int k = 0; k < b; ++k) sum -= m[a][k] * m[b][k];
      m[a][b] = a == b ? std::sqrt(std::max(sum, least)) : sum / m[b][b];
    }
  for (int a = 0; a < kTerms; ++a) {
    c[a] = a == 0;
    for (int k = 0; k < a; ++k) c[a] -= m[a][k] * c[k];
    c[a] /= m[a][a];
  }
  for (int a = kTerms - 1; a >= 0; --a) {
    for (int k = a + 1; k < kTerms; ++k) c[a] -= m[k][a] * c[k];
    c[a] /= m[a][a];
  }
}

// Ring boundaries coincide with levels.
size_t ring_of(float square, float size) {
  size_t r = 0;
  while (r + 1 < SurfaceKernel::kRings && square >= kBandwidth[r + 1] * kBandwidth[r + 1] * size * size) ++r;
  return r;
}

}  // namespace

std::span<const uint32_t> SurfaceKernel::around(uint32_t site, float texels) {
  KeptWindows* const kept = texels == kBandwidth[kLevels - 1] ? tables_.kept : nullptr;
  if (kept)
    if (const size_t count = kept->find(site, around_)) return {around_.data(), count};
  const std::span<const uint32_t> found = window_.around(site, texels * sites_.texel_size[site]);
  if (kept) kept->keep(found);
  return found;
}

std::span<const uint32_t> SurfaceKernel::sites_within(uint32_t site, float texels) {
  if (tables_.regular) {
    const size_t count = RegularWindows::shape().within(texels);
    if (tables_.regular->find(site, known_, count, around_)) return {around_.data(), count};
  }
  return window_.around(site, texels * sites_.texel_size[site]);
}

// The weights of a grid with one texel of 1.
const std::array<SurfaceKernel::Weights, kLevels>& SurfaceKernel::regular_weights() {
  static_assert(RegularWindows::kTexels == kBandwidth[kLevels - 1]);
  static const std::array<Weights, kLevels> weights = [] {
    const SiteGeometry none;
    const SurfaceLinks unlinked;
    SurfaceKernel grid(none, unlinked, {}, {});
    grid.take_shape();
    std::array<Weights, kLevels> out{};
    for (uint32_t level = 1; level < kLevels; ++level) grid.regression(level, out[level]);
    return out;
  }();
  return weights;
}

// All of the widest window but its sites.
void SurfaceKernel::take_shape() {
  const RegularWindows::Shape& shape = RegularWindows::shape();
  size_ = 1;
  for (size_t r = 0; r < kRings; ++r) end_[r] = shape.within(kBandwidth[r + 1]);
  for (size_t k = 0; k < shape.count; ++k) {
    x_[k] = shape.x[k];
    y_[k] = shape.y[k];
    square_[k] = shape.square[k];
    agreement_[k] = 1;
  }
}

bool SurfaceKernel::enter_regular(uint32_t site, float texels) {
  if (!tables_.regular) return false;
  const size_t count = RegularWindows::shape().within(texels);
  if (!tables_.regular->find(site, known_, count, site_)) return false;
  if (!is_regular_) take_shape();
  count_ = count;
  return is_regular_ = true;
}

void SurfaceKernel::enter(uint32_t site, float texels) {
  if (enter_regular(site, texels)) return;
  is_regular_ = false;
  const Vec3 centre = sites_.position[site], normal = sites_.normal[site];
  const float size = sites_.texel_size[site];
  size_ = size;
  const Frame frame(normal);
  // Nearer sites first, so that narrow filters end early.
  const std::span<const uint32_t> around = this->around(site, texels);
  std::array<uint8_t, SurfaceWindow::kMax> ring;
  std::array<size_t, kRings + 1> next{};
  for (size_t i = 0; i < around.size(); ++i) {
    const Vec3 d = sites_.position[around[i]] - centre;
    ring[i] = known_[around[i]] ? ring_of(dot(d, d), size) : kRings;
    ++next[ring[i]];
  }
  size_t begin = 0;
  for (size_t r = 0; r <= kRings; ++r) {
    const size_t count = next[r];
    next[r] = begin;
    begin += count;
    if (r < kRings) end_[r] = begin;
  }
  count_ = end_[kRings - 1];
  for (size_t i = 0; i < around.size(); ++i) {
    if (ring[i] == kRings) continue;
    const uint32_t other = around[i];
    const size_t at = next[ring[i]]++;
    const Vec3 d = sites_.position[other] - centre;
    site_[at] = other;
    x_[at] = dot(d, frame.x);
    y_[at] = dot(d, frame.y);
    square_[at] = dot(d, d);
    // Ward 1988 also weights by the angle of the normals; here the weight falls to 0 at the window's largest
    // angle.
    const float agreement =
        (dot(sites_.normal[other], normal) - SurfaceWindow::kMinCosine) / (1 - SurfaceWindow::kMinCosine);
    agreement_[at] = at == 0 ? 1.0 : std::clamp(double{agreement}, 0.0, 1.0);
  }
}

void SurfaceKernel::linear(float texels, size_t count, Weights& out) const {
  const double h = texels * size_, inverse = h > 0 ? 1 / h : 0;
  double sum = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (size_t i = 0; i < count; ++i) {
    const double w = i == 0 ? 1.0 : falloff(i, texels), x = x_[i] * inverse, y = y_[i] * inverse;
    out[i] = w;
    sum += w;
    sx += w * x, sy += w * y;
    sxx += w * x * x, sxy += w * x * y, syy += w * y * y;
  }
  const double mx = sx / sum, my = sy / sum;
  const double xx = sxx / sum - mx * mx + kMinSpread, yy = syy / sum - my * my + kMinSpread;
  const double xy = sxy / sum - mx * my, det = xx * yy - xy * xy;
  const double gx = (my * xy - mx * yy) / det, gy = (mx * xy - my * xx) / det;
  for (size_t i = 0; i < count; ++i)
    out[i] *= (1 + gx * (x_[i] * inverse - mx) + gy * (y_[i] * inverse - my)) / sum;
}

void SurfaceKernel::quadratic(float texels, size_t count, Weights& out) const {
  const double h = texels * size_, inverse = h > 0 ? 1 / h : 0;
  // Moments of x^a y^b by row of a + b: the fifteen that make up the 21 entries of the matrix.
  double m0 = 0, m1[2] = {}, m2[3] = {}, m3[4] = {}, m4[5] = {};
  for (size_t i = 0; i < count; ++i) {
    const double w = i == 0 ? 1.0 : falloff(i, texels), x = x_[i] * inverse, y = y_[i] * inverse;
    const double wx = w * x, wy = w * y, xx = x * x, xy = x * y, yy = y * y;
    out[i] = w;
    m0 += w;
    m1[0] += wx, m1[1] += wy;
    m2[0] += w * xx, m2[1] += w * xy, m2[2] += w * yy;
    m3[0] += wx * xx, m3[1] += wx * xy, m3[2] += wx * yy, m3[3] += wy * yy;
    m4[0] += w * xx * xx, m4[1] += w * xx * xy, m4[2] += w * xx * yy, m4[3] += w * xy * yy,
        m4[4] += w * yy * yy;
  }
  double c[kTerms], m[kTerms][kTerms] = {{m0},
                                         {m1[0], m2[0]},
                                         {m1[1], m2[1], m2[2]},
                                         {m2[0], m3[0], m3[1], m4[0]},
                                         {m2[1], m3[1], m3[2], m4[1], m4[2]},
                                         {m2[2], m3[2], m3[3], m4[2], m4[3], m4[4]}};
  for (int a = 1; a < kTerms; ++a) m[a][a] += kMinSpread * m[0][0];
  solve_first(m, c);
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    const double x = x_[i] * inverse, y = y_[i] * inverse;
    out[i] *= c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
    sum += out[i];
  }
  for (size_t i = 0; i < count; ++i) out[i] /= sum;
}

}  // namespace kiln
