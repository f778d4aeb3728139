#include "tests/bench/log_plot.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln::bench {
namespace {

constexpr double kWidth = 300, kHeight = 230;                       // of a panel
constexpr double kLeft = 52, kRight = 12, kTop = 30, kBottom = 40;  // margins in it
constexpr const char* kColours[] = {"#0b6e99", "#d9822b", "#3a9a4a", "#8a8a8a"};

struct Axis {  // whole powers of 10 or 2 around the data
  double low, high, base;
  double part(double v) const { return std::log(v / low) / std::log(high / low); }
};

template <class Get>
Axis axis_of(const Panel& panel, double base, const Get& get) {
  double low = 1e300, high = 0;
  for (const Line& line : panel.lines)
    for (double v : get(line)) low = std::min(low, v), high = std::max(high, v);
  const double scale = std::log(base);
  return {std::pow(base, std::floor(std::log(low) / scale + 1e-9)),
          std::pow(base, std::ceil(std::log(high) / scale - 1e-9)), base};
}

std::string label(double x, double y, const char* anchor, const std::string& what) {
  return text("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, what);
}

std::string draw(const Panel& panel, double left, double top, const std::string& x_name,
                 const std::string& quantity) {
  const double w = kWidth - kLeft - kRight, h = kHeight - kTop - kBottom;
  const Axis ax = axis_of(
      panel, 4, [](const Line& l) -> auto& { return l.x; });
  const Axis ay = axis_of(
      panel, 10, [](const Line& l) -> auto& { return l.y; });
  const auto px = [&](double v) { return left + kLeft + w * ax.part(v); };
  const auto py = [&](double v) { return top + kTop + h * (1 - ay.part(v)); };
  std::string out = label(left + kLeft + w / 2, top + 16, "middle", panel.title);
  const auto grid = [&](double x0, double y0, double x1, double y1) {
    out += text("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"#ddd\"/>\n", x0, y0, x1, y1);
  };
  for (double v = ax.low; v <= ax.high * 1.01; v *= ax.base) {
    grid(px(v), py(ay.low), px(v), py(ay.high));
    out += label(px(v), top + kHeight - kBottom + 14, "middle", text("{:.0f}", v));
  }
  for (double v = ay.low; v <= ay.high * 1.01; v *= ay.base) {
    grid(px(ax.low), py(v), px(ax.high), py(v));
    out += label(left + kLeft - 6, py(v) + 4, "end", text("{:g}", v));
  }
  out += label(left + kLeft + w / 2, top + kHeight - 10, "middle", x_name);
  out += text("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
              left + 12, top + kTop + h / 2, quantity);
  for (size_t i = 0; i < panel.lines.size(); ++i) {
    std::string points;
    for (size_t k = 0; k < panel.lines[i].x.size(); ++k)
      points += text("{:.1f},{:.1f} ", px(panel.lines[i].x[k]), py(panel.lines[i].y[k]));
    out += text("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>\n", points,
                kColours[i % std::size(kColours)]);
  }
  return out;
}

}  // namespace

std::string log_plot(const std::vector<Panel>& panels, size_t columns, const std::string& x_name,
                     const std::string& quantity) {
  const double rows = std::ceil(static_cast<double>(panels.size()) / static_cast<double>(columns));
  const double width = kWidth * static_cast<double>(columns), height = kHeight * rows + 24;
  std::string out = text(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" "
      "fill=\"#fff\"/>\n",
      width, height);
  for (size_t i = 0; i < panels.size(); ++i)
    out += draw(panels[i], kWidth * static_cast<double>(i % columns),
                kHeight * static_cast<double>(i / columns), x_name, quantity);
  const std::vector<Line>& lines = panels.front().lines;
  for (size_t i = 0; i < lines.size(); ++i) {
    const double x = kLeft + 110 * static_cast<double>(i), y = height - 10;
    out += text("<path d=\"M{:.1f} {:.1f}h24\" stroke=\"{}\" stroke-width=\"2\"/>\n", x, y - 4,
                kColours[i % std::size(kColours)]);
    out += label(x + 30, y, "start", lines[i].name);
  }
  return out + "</svg>\n";
}

}  // namespace kiln::bench
