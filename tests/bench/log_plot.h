// Line plots with logarithmic axes, as one SVG of panels side by side.
#pragma once

#include <string>
#include <vector>

namespace kiln::bench {

struct Line {
  std::string name;
  std::vector<double> x, y;  // positive
};
struct Panel {
  std::string title;
  std::vector<Line> lines;  // the same names in every panel
};

// `columns` panels a row; y is labelled with `quantity`.
std::string log_plot(const std::vector<Panel>& panels, size_t columns, const std::string& x_name,
                     const std::string& quantity);

}  // namespace kiln::bench
