#include "coordinator/picture/canvas.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/picture/label.h"

namespace kiln {
namespace {

std::string hex(const InkColor& c) {
  return text("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

std::string escaped(const std::string& s) {
  std::string out;
  for (const char c : s) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else if (static_cast<unsigned char>(c) >= ' ')
      out += c;
  }
  return out;
}

// Distance of a point from a line segment.
double distance(double x, double y, double x0, double y0, double x1, double y1) {
  const double dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
  const double t = square > 0 ? std::clamp(((x - x0) * dx + (y - y0) * dy) / square, 0.0, 1.0) : 0;
  return std::hypot(x - x0 - t * dx, y - y0 - t * dy);
}

}  // namespace

SvgCanvas::SvgCanvas(double width, double height)
    : out_(
          text("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 "
               "{0:.0f} "
               "{1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
               "fill=\"#fff\"/>\n",
               width, height)) {}

void SvgCanvas::line(double x0, double y0, double x1, double y1, double width, const InkColor& ink) {
  out_ += text(
      "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\" stroke-width=\"{:g}\" "
      "stroke-linecap=\"round\"/>\n",
      x0, y0, x1, y1, hex(ink), width);
}

void SvgCanvas::dot(double x, double y, double radius, const InkColor& ink) {
  out_ += text("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:g}\" fill=\"{}\"/>\n", x, y, radius, hex(ink));
}

void SvgCanvas::word(double x, double y, Anchor anchor, const std::string& what, const InkColor& ink) {
  const char* side = anchor == Anchor::kStart ? "start" : anchor == Anchor::kMiddle ? "middle" : "end";
  out_ += text("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\">{}</text>\n", x, y, side,
               hex(ink), escaped(what));
}

std::string SvgCanvas::take() {
  return std::move(out_) + "</svg>\n";
}

PixelCanvas::PixelCanvas(double width, double height, uint32_t scale)
    : scale_(scale),
      picture_(static_cast<uint32_t>(width * scale), static_cast<uint32_t>(height * scale), 255) {}

void PixelCanvas::blend(int64_t x, int64_t y, double coverage, const InkColor& ink) {
  if (coverage <= 0 || x < 0 || y < 0 || x >= picture_.width || y >= picture_.height) return;
  uint8_t* const at = &picture_.rgb[(static_cast<size_t>(y) * picture_.width + static_cast<size_t>(x)) * 3];
  for (size_t k = 0; k < 3; ++k)
    at[k] = static_cast<uint8_t>(at[k] + (ink[k] - at[k]) * std::min(1.0, coverage) + 0.5);
}

void PixelCanvas::line(double x0, double y0, double x1, double y1, double width, const InkColor& ink) {
  for (double* v : {&x0, &y0, &x1, &y1, &width}) *v *= scale_;
  const double reach = width / 2 + 1;
  for (auto y = static_cast<int64_t>(std::min(y0, y1) - reach); y <= std::max(y0, y1) + reach; ++y)
    for (auto x = static_cast<int64_t>(std::min(x0, x1) - reach); x <= std::max(x0, x1) + reach; ++x)
      blend(x, y, width / 2 + 0.5 - distance(x + 0.5, y + 0.5, x0, y0, x1, y1), ink);
}

void PixelCanvas::dot(double x, double y, double radius, const InkColor& ink) {
  line(x, y, x, y, 2 * radius, ink);
}

void PixelCanvas::word(double x, double y, Anchor anchor, const std::string& what, const InkColor& ink) {
  std::string small = what;  // labels have small letters only
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto scale = static_cast<uint32_t>(scale_);
  const double width = label_width(scale, small);
  const double left = x * scale_ - (anchor == Anchor::kStart    ? 0
                                    : anchor == Anchor::kMiddle ? width / 2
                                                                : width);
  draw_label(picture_, static_cast<uint32_t>(std::max(0.0, left)),
             static_cast<uint32_t>(std::max(0.0, y * scale_ - kLabelHeight * scale)), scale, small, ink);
}

}  // namespace kiln
