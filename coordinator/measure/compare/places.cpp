#include "coordinator/measure/compare/places.h"

#include "coordinator/measure/compare/chart_boxes.h"

namespace kiln {
namespace {

// Name of the object that owns a chart number.
std::string owner_of(const ChartFile& file, uint32_t chart) {
  for (const ChartObject& object : file.objects)
    if (object.first >= 0 && chart >= object.first && chart < object.first + object.count) return object.name;
  return {};
}

}  // namespace

void name_places(const std::filesystem::path& folder, std::span<WorstTexel> texels) {
  const std::optional<ChartFile> file = read_chart_boxes(folder);
  if (!file) return;
  for (WorstTexel& t : texels) {
    const ChartRegion* smallest = nullptr;
    for (const ChartRegion& box : file->boxes)
      if (box.page == t.page && box.reaches(t.x, t.y) && (!smallest || box.area() < smallest->area()))
        smallest = &box;
    if (smallest) t.object = owner_of(*file, smallest->chart);
  }
}

}  // namespace kiln
