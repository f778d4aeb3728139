// Curves of error against cost with logarithmic axes.
#pragma once

#include "coordinator/picture/canvas.h"

namespace kiln {

struct PlotLine {
  std::string name;
  std::vector<double> x, y;  // points that are not positive are left out
};

struct PlotPanel {
  std::string title, x_name, y_name;
  std::vector<PlotLine> lines;  // same names in every panel: the legend shows the first's
};

// Panels side by side on one canvas, `footer` below them.
struct ErrorPlot {
  std::vector<PlotPanel> panels;
  std::string footer;

  double width() const;
  double height() const;
  void draw(Canvas& canvas) const;
};

}  // namespace kiln
