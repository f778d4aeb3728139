#include "coordinator/measure/compare/ssim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/parallel.h"
#include "common/image/image.h"
#include "coordinator/measure/compare/chart_boxes.h"

namespace kiln {
namespace {

constexpr int kReach = 5;
constexpr double kSigma = 1.5, kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;  // for a range of 1

struct Shown {
  std::vector<float> a, b;
  std::vector<uint32_t> chart;  // 0: does not count
};

double reference_of(const ErrorMap& b, const ErrorMap* b2, size_t t) {
  return b2 ? 0.5 * (b.light[t] + b2->light[t]) : b.light[t];
}

Shown show(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2, const std::vector<uint32_t>& charts) {
  Shown s;
  s.chart.assign(charts.size(), 0);
  double mean = 0, count = 0;
  for (size_t t = 0; t < charts.size(); ++t) {
    if (!a.measured[t] || !b.measured[t] || (b2 && !b2->measured[t])) continue;
    s.chart[t] = charts[t];
    mean += reference_of(b, b2, t);
    ++count;
  }
  mean = count > 0 ? mean / count : 0;
  const auto curve = [&](double light) {
    const double l = std::max(0.0, light), sum = l + std::max(mean, std::numeric_limits<double>::min());
    return linear_to_srgb(static_cast<float>(l / sum));
  };
  for (size_t t = 0; t < charts.size(); ++t) {
    s.a.push_back(s.chart[t] ? curve(a.light[t]) : 0);
    s.b.push_back(s.chart[t] ? curve(reference_of(b, b2, t)) : 0);
  }
  return s;
}

// NaN if the window does not count.
double window_similarity(const ErrorMap& layout, const Shown& s, size_t t) {
  static const std::array<double, 2 * kReach + 1> kWeights = [] {
    std::array<double, 2 * kReach + 1> w{};
    for (int i = -kReach; i <= kReach; ++i)
      w[static_cast<size_t>(i + kReach)] = std::exp(-0.5 * i * i / (kSigma * kSigma));
    return w;
  }();
  const int width = static_cast<int>(layout.width), height = static_cast<int>(layout.page_height);
  const int x = static_cast<int>(t % layout.width),
            y = static_cast<int>(t / layout.width % layout.page_height);
  double sum = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
  int count = 0;
  for (int dy = std::max(-kReach, -y); dy <= std::min(kReach, height - 1 - y); ++dy)
    for (int dx = std::max(-kReach, -x); dx <= std::min(kReach, width - 1 - x); ++dx) {
      const size_t n = t + static_cast<size_t>(dy) * layout.width + static_cast<size_t>(dx);  // modulo 2^64
      if (s.chart[n] != s.chart[t]) continue;
      const double w =
          kWeights[static_cast<size_t>(dx + kReach)] * kWeights[static_cast<size_t>(dy + kReach)];
      const double va = s.a[n], vb = s.b[n];
      sum += w, ma += w * va, mb += w * vb, aa += w * va * va, bb += w * vb * vb, ab += w * va * vb;
      ++count;
    }
  if (count < kMinWindow) return std::numeric_limits<double>::quiet_NaN();
  ma /= sum, mb /= sum;
  const double va = std::max(0.0, aa / sum - ma * ma), vb = std::max(0.0, bb / sum - mb * mb);
  return (2 * ma * mb + kC1) * (2 * (ab / sum - ma * mb) + kC2) /
         ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
}

}  // namespace

std::vector<uint32_t> touching_texels(const ErrorMap& map) {
  std::vector<uint32_t> label(map.light.size(), 0);
  uint32_t next = 0;
  std::vector<size_t> stack;
  for (size_t start = 0; start < label.size(); ++start) {
    if (!map.measured[start] || label[start]) continue;
    label[start] = ++next;
    stack.push_back(start);
    while (!stack.empty()) {
      const size_t t = stack.back(), x = t % map.width, y = t / map.width % map.page_height;
      stack.pop_back();
      const auto visit = [&](size_t n) {
        if (!map.measured[n] || label[n]) return;
        label[n] = next;
        stack.push_back(n);
      };
      if (x > 0) visit(t - 1);
      if (x + 1 < map.width) visit(t + 1);
      if (y > 0) visit(t - map.width);
      if (y + 1 < map.page_height) visit(t + map.width);
    }
  }
  return label;
}

std::vector<uint32_t> chart_labels(const ErrorMap& map, std::vector<ChartRegion> boxes) {
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const ChartRegion& a, const ChartRegion& b) { return a.area() > b.area(); });
  // Painted from large to small.
  std::vector<uint32_t> label(map.light.size(), 0);
  const auto cell = [](double v, uint32_t most) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(most)));
  };
  for (const ChartRegion& b : boxes) {
    if (b.page >= map.pages) continue;
    for (uint32_t y = cell(std::floor(b.top), map.page_height);
         y < cell(std::ceil(b.bottom), map.page_height); ++y)
      for (uint32_t x = cell(std::floor(b.left), map.width); x < cell(std::ceil(b.right), map.width); ++x) {
        const size_t t = (size_t{b.page} * map.page_height + y) * map.width + x;
        if (map.measured[t]) label[t] = b.chart + 1;
      }
  }
  return label;
}

std::optional<double> structural_similarity(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2) {
  const std::vector<uint32_t> charts = !a.chart.empty()   ? a.chart
                                       : !b.chart.empty() ? b.chart
                                                          : touching_texels(a);
  const Shown shown = show(a, b, b2, charts);
  const size_t rows = charts.size() / std::max<size_t>(1, a.width);
  std::vector<double> sums(rows, 0.0), counts(rows, 0.0);
  parallel_for(rows, [&](size_t row) {
    for (size_t t = row * a.width; t < (row + 1) * a.width; ++t) {
      if (!shown.chart[t]) continue;
      const double v = window_similarity(a, shown, t);
      if (std::isnan(v)) continue;
      sums[row] += v;
      ++counts[row];
    }
  });
  double sum = 0, count = 0;
  for (size_t row = 0; row < rows; ++row) sum += sums[row], count += counts[row];
  if (!(count > 0)) return std::nullopt;
  return sum / count;
}

}  // namespace kiln
