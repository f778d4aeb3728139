// The boxes of charts, read from a bake's charts.json.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kiln {

struct ChartRegion {
  double left = 0, top = 0, right = 0, bottom = 0;  // texels of the page
  uint32_t page = 0;
  uint32_t chart = 0;  // its number in the file
  double area() const { return (right - left) * (bottom - top); }
  // A texel belongs to a chart whose box overlaps it; of several boxes the smallest counts, since
  // charts may lie in each other's gaps.
  bool reaches(uint32_t x, uint32_t y) const {
    return x + 1 > left && x < right && y + 1 > top && y < bottom;
  }
};
struct ChartObject {
  std::string name;
  double first = 0, count = 0;  // range of its charts
};
struct ChartFile {
  std::vector<ChartRegion> boxes;
  std::vector<ChartObject> objects;
};

// Nothing if the file does not exist or cannot be read.
std::optional<ChartFile> read_chart_boxes(const std::filesystem::path& folder);

}  // namespace kiln
