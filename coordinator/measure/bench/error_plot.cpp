#include "coordinator/measure/bench/error_plot.h"

#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr double kPanelWidth = 460, kPanelHeight = 340;
constexpr double kLeft = 62, kRight = 28, kTop = 30, kBottom = 44;  // margins of a panel
constexpr double kLegend = 26, kFooter = 24, kLegendStep = 110;
constexpr InkColor kInk = {40, 40, 40}, kGrid = {221, 221, 221};
// Okabe and Ito: distinguishable with any colour vision.
constexpr InkColor kInks[] = {{0, 0, 0},       {0, 114, 178}, {213, 94, 0},  {0, 158, 115},
                              {204, 121, 167}, {230, 159, 0}, {86, 180, 233}};

// Whole decades around the data.
struct LogAxis {
  double low = 1e300, high = 0;

  void add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void round() {
    if (!(high > 0)) low = 0.1, high = 10;
    low = std::pow(10.0, std::floor(std::log10(low) + 1e-9));
    high = std::pow(10.0, std::ceil(std::log10(high) - 1e-9));
    if (high <= low) high = 10 * low;
  }
  double part(double v) const { return std::log(v / low) / std::log(high / low); }
};

std::string tick_text(double v) {
  return v >= 1e6 || v < 1e-3 ? text("{:.0e}", v) : text("{:g}", v);
}

class PanelDrawing {
 public:
  PanelDrawing(Canvas& canvas, const PlotPanel& panel, double left)
      : canvas_(canvas), panel_(panel), left_(left + kLeft), top_(kTop) {
    for (const PlotLine& line : panel.lines)
      for (size_t i = 0; i < line.x.size(); ++i)
        if (line.x[i] > 0 && line.y[i] > 0) x_.add(line.x[i]), y_.add(line.y[i]);
    x_.round();
    y_.round();
  }

  void draw() {
    canvas_.word(left_, top_ - 12, Anchor::kStart, panel_.title + ": " + panel_.y_name, kInk);
    canvas_.word(left_ + kWide / 2, top_ + kHigh + 36, Anchor::kMiddle, panel_.x_name, kInk);
    for (double v = x_.low; v <= x_.high * 1.01; v *= 10) {
      canvas_.line(at_x(v), top_, at_x(v), top_ + kHigh, 1, kGrid);
      canvas_.word(at_x(v), top_ + kHigh + 16, Anchor::kMiddle, tick_text(v), kInk);
    }
    for (double v = y_.low; v <= y_.high * 1.01; v *= 10) {
      canvas_.line(left_, at_y(v), left_ + kWide, at_y(v), 1, kGrid);
      canvas_.word(left_ - 6, at_y(v) + 4, Anchor::kEnd, tick_text(v), kInk);
    }
    for (size_t k = 0; k < panel_.lines.size(); ++k) draw_line(panel_.lines[k], kInks[k % std::size(kInks)]);
  }

 private:
  static constexpr double kWide = kPanelWidth - kLeft - kRight, kHigh = kPanelHeight - kTop - kBottom;
  double at_x(double v) const { return left_ + kWide * x_.part(v); }
  double at_y(double v) const { return top_ + kHigh * (1 - y_.part(v)); }

  void draw_line(const PlotLine& line, const InkColor& ink) {
    double x = 0, y = 0;
    bool begun = false;
    for (size_t i = 0; i < line.x.size(); ++i) {
      if (!(line.x[i] > 0) || !(line.y[i] > 0)) continue;
      const double to_x = at_x(line.x[i]), to_y = at_y(line.y[i]);
      if (begun) canvas_.line(x, y, to_x, to_y, 1.6, ink);
      canvas_.dot(to_x, to_y, 2.6, ink);
      x = to_x;
      y = to_y;
      begun = true;
    }
  }

  Canvas& canvas_;
  const PlotPanel& panel_;
  double left_, top_;
  LogAxis x_, y_;
};

}  // namespace

double ErrorPlot::width() const {
  return kPanelWidth * static_cast<double>(panels.size());
}

double ErrorPlot::height() const {
  return kPanelHeight + kLegend + kFooter;
}

void ErrorPlot::draw(Canvas& canvas) const {
  for (size_t i = 0; i < panels.size(); ++i)
    PanelDrawing(canvas, panels[i], kPanelWidth * static_cast<double>(i)).draw();
  const double y = kPanelHeight + 14;
  for (size_t k = 0; !panels.empty() && k < panels[0].lines.size(); ++k) {
    const double x = kLeft + kLegendStep * static_cast<double>(k);
    canvas.line(x, y - 4, x + 22, y - 4, 2, kInks[k % std::size(kInks)]);
    canvas.word(x + 28, y, Anchor::kStart, panels[0].lines[k].name, kInk);
  }
  canvas.word(kLeft, kPanelHeight + kLegend + 14, Anchor::kStart, footer, kInk);
}

}  // namespace kiln
