#include "coordinator/measure/compare/difference_picture.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/picture/label.h"

namespace kiln {
namespace {

using Color = std::array<uint8_t, 3>;

constexpr Color kUnmeasured = {96, 96, 96}, kInk = {20, 20, 20};
constexpr uint32_t kMinSide = 512, kLegend = 56, kMargin = 16, kBar = 14;

// Diverging colours: white in the middle, ColorBrewer's RdBu at the ends. t in [-1, 1].
Color diverging(double t) {
  const double end[2][3] = {{33, 102, 172}, {178, 24, 43}};
  Color c;
  for (size_t k = 0; k < 3; ++k)
    c[k] = static_cast<uint8_t>(255 + (end[t > 0][k] - 255) * std::min(1.0, std::fabs(t)) + 0.5);
  return c;
}

double full_scale(const std::vector<double>& relative) {
  std::vector<double> sizes;
  for (const double v : relative)
    if (std::isfinite(v) && v != 0) sizes.push_back(std::fabs(v));
  if (sizes.empty()) return 0.01;
  const size_t rank = (sizes.size() - 1) * 99 / 100;
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<ptrdiff_t>(rank), sizes.end());
  return round_up_125(sizes[rank]);
}

void draw_legend(Picture& picture, uint32_t top, double full) {
  const uint32_t width = picture.width - 2 * kMargin;
  for (uint32_t x = 0; x < width; ++x)
    for (uint32_t y = 0; y < kBar; ++y)
      picture.set(kMargin + x, top + y, diverging(2.0 * x / (width - 1) - 1));
  const std::string low = text("-{:g} %", 100 * full), high = text("+{:g} %", 100 * full);
  const uint32_t line = top + kBar + 6;
  draw_label(picture, kMargin, line, 2, low, kInk);
  draw_label(picture, picture.width - kMargin - label_width(2, high), line, 2, high, kInk);
  const std::string_view middle = "error relative to the reference";
  draw_label(picture, picture.width / 2 - label_width(1, middle) / 2, line + 4, 1, middle, kInk);
}

}  // namespace

double round_up_125(double v) {
  const double power = std::pow(10.0, std::floor(std::log10(v) + 1e-12));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= v * (1 - 1e-12)) return step * power;
  return 10 * power;
}

Picture difference_picture(const ErrorMap& layout, const std::vector<double>& relative) {
  const uint32_t height = layout.page_height * layout.pages;
  const uint32_t zoom = std::max(1u, (kMinSide + layout.width - 1) / layout.width);
  Picture picture(layout.width * zoom, height * zoom + kLegend, 255);
  const double full = full_scale(relative);
  for (uint32_t y = 0; y < height * zoom; ++y)
    for (uint32_t x = 0; x < picture.width; ++x) {
      const double v = relative[size_t{y / zoom} * layout.width + x / zoom];
      picture.set(x, y, std::isfinite(v) ? diverging(v / full) : kUnmeasured);
    }
  draw_legend(picture, height * zoom + 8, full);
  return picture;
}

}  // namespace kiln
