// Lines, dots and words, as SVG or as pixels: one drawing makes both files.
#pragma once

#include <memory>
#include <string>

#include "coordinator/picture/picture.h"

namespace kiln {

enum class Anchor { kStart, kMiddle, kEnd };
using InkColor = std::array<uint8_t, 3>;

// Coordinates are in SVG pixels, y downwards; anything outside is clipped.
class Canvas {
 public:
  virtual ~Canvas() = default;
  virtual void line(double x0, double y0, double x1, double y1, double width, const InkColor& ink) = 0;
  virtual void dot(double x, double y, double radius, const InkColor& ink) = 0;
  // y is the baseline. `text` is ASCII.
  virtual void word(double x, double y, Anchor anchor, const std::string& text, const InkColor& ink) = 0;
};

class SvgCanvas final : public Canvas {
 public:
  SvgCanvas(double width, double height);
  void line(double x0, double y0, double x1, double y1, double width, const InkColor& ink) override;
  void dot(double x, double y, double radius, const InkColor& ink) override;
  void word(double x, double y, Anchor anchor, const std::string& text, const InkColor& ink) override;
  std::string take();  // the file; call once

 private:
  std::string out_;
};

class PixelCanvas final : public Canvas {
 public:
  PixelCanvas(double width, double height, uint32_t scale);  // `scale` pixels per unit
  void line(double x0, double y0, double x1, double y1, double width, const InkColor& ink) override;
  void dot(double x, double y, double radius, const InkColor& ink) override;
  void word(double x, double y, Anchor anchor, const std::string& text, const InkColor& ink) override;
  const Picture& picture() const { return picture_; }

 private:
  void blend(int64_t x, int64_t y, double coverage, const InkColor& ink);
  double scale_;
  Picture picture_;
};

}  // namespace kiln
