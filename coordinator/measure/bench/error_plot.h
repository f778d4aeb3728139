// Curves of error against cost, both axes logarithmic.
#pragma once

#include "coordinator/picture/canvas.h"

namespace kiln {

struct PlotLine {
  std::string name;
  std::vector<double> x, y;  // points with a part that is not above 0 are left out
};

struct PlotPanel {
  std::string title, x_name, y_name;
  std::vector<PlotLine> lines;  // the same names in every panel: the legend is of the first
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
