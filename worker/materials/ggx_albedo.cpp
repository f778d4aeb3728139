#include "worker/materials/ggx_albedo.h"

namespace kiln {
namespace {

float fourth_root(float x) {
  return std::sqrt(std::sqrt(x));
}
const float kLeastRoot = fourth_root(kLeastAlpha);

float alpha_of_row(int row) {
  const float root = kLeastRoot + (1.0f - kLeastRoot) * static_cast<float>(row) / GgxAlbedo::kRows;
  return root * root * root * root;
}

// The lobe's samples of visible normals weigh F G2 / G1; a Fibonacci lattice of them is a quadrature whose
// every point has another height, because the horizon may cut at one; q keeps them dense in the lobe's long
// tail. Half of the circle does, by symmetry.
GgxAlbedo::Terms integrate(float cos, float alpha) {
  constexpr uint32_t kPoints = 987, kStep = 610;
  const Vec3 wo(std::sqrt(1.0f - cos * cos), 0.0f, cos);
  const float smith_o = ggx_smith(cos, alpha);
  double sum[4] = {};
  for (uint32_t k = 0; k < kPoints; ++k) {
    const float q = (static_cast<float>(k) + 0.5f) / kPoints;  // weighs 2 q
    const Vec2 u(1.0f - q * q, static_cast<float>(k * kStep % kPoints) / (2.0f * kPoints));
    const Vec3 h = ggx_visible_normal(wo, alpha, u);
    const float wo_h = dot(wo, h);
    const float cos_i = 2.0f * wo_h * h.z - cos;
    if (!(cos_i > 0.0f)) continue;
    const float weight =
        2.0f * q * cos_i * (cos + smith_o) / (cos * ggx_smith(cos_i, alpha) + cos_i * smith_o);
    const float rise = fifth_power_of_rest(wo_h), under = fifth_power_of_rest(cos_i);
    sum[0] += weight * (1.0f - rise);
    sum[1] += weight * rise;
    sum[2] += weight * (1.0f - rise) * under;
    sum[3] += weight * rise * under;
  }
  float mean[4];
  for (int k = 0; k < 4; ++k) mean[k] = static_cast<float>(sum[k] / kPoints);
  return {{mean[0], mean[1]}, {mean[2], mean[3]}};
}

// 2 int f cos dcos = 4 int f(t) t^3 dt with t the root of the cosine, f linear between the row's entries: by
// the midpoint rule on kParts of every cell, 1e-5 from it.
template <class F>
ByFresnel mean_over_cosine(const std::array<ByFresnel, GgxAlbedo::kColumns + 1>& row, const F& weight) {
  constexpr int kParts = 16;
  double f0 = 0, f90 = 0, all = 0;
  for (int c = 0; c < GgxAlbedo::kColumns; ++c)
    for (int k = 0; k < kParts; ++k) {
      const double x = (k + 0.5) / kParts, t = (c + x) / GgxAlbedo::kColumns, w = t * t * t;
      const double under = w * weight(static_cast<float>(t * t));
      f0 += under * (row[c].f0 * (1 - x) + row[c + 1].f0 * x);
      f90 += under * (row[c].f90 * (1 - x) + row[c + 1].f90 * x);
      all += w;
    }
  return {static_cast<float>(f0 / all), static_cast<float>(f90 / all)};
}

GgxAlbedo::Terms operator*(const GgxAlbedo::Terms& t, float s) {
  return {t.albedo * s, t.fifth * s};
}
GgxAlbedo::Terms operator+(const GgxAlbedo::Terms& a, const GgxAlbedo::Terms& b) {
  return {a.albedo + b.albedo, a.fifth + b.fifth};
}
GgxAlbedo::Means mix(const GgxAlbedo::Means& a, const GgxAlbedo::Means& b, float t) {
  return {a.plain * (1.0f - t) + b.plain * t, a.under_fifth * (1.0f - t) + b.under_fifth * t};
}

}  // namespace

template <class F>
GgxAlbedo::Means GgxAlbedo::means_of(const Row& albedo, const Row& fifth, const F& weight) {
  const auto under_fifth = [&](float cos) { return weight(cos) * fifth_power_of_rest(cos); };
  return {{mean_over_cosine(albedo, weight), mean_over_cosine(fifth, weight)},
          {mean_over_cosine(albedo, under_fifth), mean_over_cosine(fifth, under_fifth)}};
}

GgxAlbedo::Tables::Tables() {
  for (int r = 0; r <= kRows; ++r) {
    for (int c = 0; c <= kColumns; ++c) {
      const float t = static_cast<float>(c) / kColumns;
      const Terms terms = integrate(t * t, alpha_of_row(r));
      rows[0][r][c] = terms.albedo;
      rows[1][r][c] = terms.fifth;
    }
    means[r] = means_of(rows[0][r], rows[1][r], [](float) { return 1.0f; });
  }
}

const GgxAlbedo::MeansUnderSheen& GgxAlbedo::means_under_sheen() {
  static const MeansUnderSheen all = [] {
    MeansUnderSheen m;
    for (int s = 0; s <= SheenAlbedo::kRows; ++s) {
      const SheenAlbedo sheen = SheenAlbedo::of_row(s);
      for (int r = 0; r <= kRows; ++r)
        m[s][r] =
            means_of(tables().rows[0][r], tables().rows[1][r], [&](float cos) { return sheen.at(cos); });
    }
    return m;
  }();
  return all;
}

const GgxAlbedo::Tables& GgxAlbedo::tables() {
  static const Tables all;
  return all;
}

GgxAlbedo::GgxAlbedo(float alpha) : tables_(&tables()) {
  const float at = (fourth_root(alpha) - kLeastRoot) / (1.0f - kLeastRoot) * kRows;
  row_ = std::clamp(static_cast<int>(at), 0, kRows - 1);
  blend_ = std::clamp(at - static_cast<float>(row_), 0.0f, 1.0f);
}

GgxAlbedo::Means GgxAlbedo::means() const {
  return mix(tables_->means[row_], tables_->means[row_ + 1], blend_);
}

GgxAlbedo::Means GgxAlbedo::means_under(const SheenAlbedo& sheen) const {
  const auto of_row = [&](int s) {
    const auto& means = means_under_sheen()[s];
    return mix(means[row_], means[row_ + 1], blend_);
  };
  return mix(of_row(sheen.row()), of_row(sheen.row() + 1), sheen.blend());
}

}  // namespace kiln
