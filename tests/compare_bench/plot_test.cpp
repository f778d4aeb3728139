#include <regex>

#include "coordinator/measure/bench/error_plot.h"

namespace kiln {
namespace {

// Elements nest, attributes are quoted, no stray markup in texts.
bool well_formed(const std::string& xml) {
  static const std::regex tag(R"(<(/?)([a-z]+)((?:\s+[a-zA-Z:-]+="[^"<>]*")*)\s*(/?)>)");
  std::vector<std::string> open;
  size_t at = 0;
  for (std::sregex_iterator it(xml.begin(), xml.end(), tag), end; it != end; ++it) {
    const std::string between = xml.substr(at, static_cast<size_t>(it->position()) - at);
    if (between.find_first_of("<>") != std::string::npos) return false;
    at = static_cast<size_t>(it->position() + it->length());
    if ((*it)[1] == "/") {
      if (open.empty() || open.back() != (*it)[2]) return false;
      open.pop_back();
    } else if ((*it)[4] != "/") {
      open.push_back((*it)[2]);
    }
  }
  return at > 0 && open.empty() && xml.find_first_not_of(" \n", at) == std::string::npos;
}

ErrorPlot plot_of(std::vector<PlotLine> lines) {
  ErrorPlot plot;
  plot.panels = {{"a <b> & \"c\"", "seconds", "relMSE", std::move(lines)}};
  plot.footer = "machine";
  return plot;
}

std::string svg_of(const ErrorPlot& plot) {
  SvgCanvas svg(plot.width(), plot.height());
  plot.draw(svg);
  return svg.take();
}

size_t dots_of(const std::string& svg) {
  const std::regex dot("<circle ");
  return static_cast<size_t>(std::distance(std::sregex_iterator(svg.begin(), svg.end(), dot), {}));
}

TEST(Plot, SvgIsWellFormedAndHasEveryPoint) {
  const std::string svg =
      svg_of(plot_of({{"one<", {1, 10, 100}, {0.1, 0.01, 0.001}}, {"two", {2, 30}, {0.5, 0.2}}}));
  EXPECT_TRUE(well_formed(svg)) << svg;
  EXPECT_EQ(dots_of(svg), 5u);
  EXPECT_NE(svg.find("one&lt;"), std::string::npos);
}

TEST(Plot, WhatHasNoLogarithmIsLeftOut) {
  const std::string svg = svg_of(plot_of({{"one", {0, 10, 100}, {0.1, -1e-9, 0.001}}, {"empty", {}, {}}}));
  EXPECT_TRUE(well_formed(svg));
  EXPECT_EQ(dots_of(svg), 1u);
  EXPECT_TRUE(well_formed(svg_of(plot_of({}))));
}

TEST(Plot, PixelsShowTheLinesOfTheSvg) {
  const ErrorPlot plot = plot_of({{"one", {1, 10}, {0.1, 0.01}}});
  PixelCanvas pixels(plot.width(), plot.height(), 2);
  plot.draw(pixels);
  const Picture& p = pixels.picture();
  EXPECT_EQ(p.width, static_cast<uint32_t>(2 * plot.width()));
  // The line falls from the upper left to the lower right corner of the panel: its middle is black.
  const std::string svg = svg_of(plot);
  const std::regex circle(R"re(<circle cx="([0-9.]+)" cy="([0-9.]+)")re");
  std::sregex_iterator it(svg.begin(), svg.end(), circle);
  const double x0 = std::stod((*it)[1]), y0 = std::stod((*it)[2]);
  ++it;
  const double x1 = std::stod((*it)[1]), y1 = std::stod((*it)[2]);
  const auto x = static_cast<size_t>(x0 + x1), y = static_cast<size_t>(y0 + y1);  // two pixels a unit
  EXPECT_LT(p.rgb[(y * p.width + x) * 3], 60);
  EXPECT_EQ(p.rgb[(y * p.width + x + 60) * 3], 255);
}

}  // namespace
}  // namespace kiln
