#include "coordinator/measure/compare/chart_boxes.h"

#include "common/base/files.h"
#include "common/base/json.h"

namespace kiln {
namespace {

constexpr uint64_t kMaxBytes = uint64_t{1} << 26;

double number_of(const JsonValue* v) {
  return v && v->kind == JsonValue::Kind::kNumber ? v->number : -1;
}

double number_of(const JsonValue& object, const char* key) {
  return number_of(object.find(key));
}

// A row of "transforms": scale x and y, offset x and y, page, turned; relative to the page as [0, 1]^2.
std::optional<ChartRegion> box_of(const JsonValue& row, double width, double height) {
  if (row.items.size() != 6) return std::nullopt;
  const auto at = [&](size_t i) { return number_of(&row.items[i]); };
  if (!(at(4) >= 0 && at(4) < 1e6)) return std::nullopt;
  return ChartRegion{at(2) * width,
                     at(3) * height,
                     (at(2) + at(0)) * width,
                     (at(3) + at(1)) * height,
                     static_cast<uint32_t>(at(4)),
                     0};
}

}  // namespace

std::optional<ChartFile> read_chart_boxes(const std::filesystem::path& folder) {
  const auto bytes = read_file(folder / "charts.json", kMaxBytes);
  if (!bytes) return std::nullopt;
  const auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!json) return std::nullopt;
  const JsonValue *charts = json->find("transforms"), *instances = json->find("instances");
  const double width = number_of(*json, "width"), height = number_of(*json, "height");
  if (!charts || !instances || !(width > 0) || !(height > 0)) return std::nullopt;
  ChartFile file;
  for (size_t i = 0; i < charts->items.size(); ++i) {
    std::optional<ChartRegion> box = box_of(charts->items[i], width, height);
    if (!box) continue;
    box->chart = static_cast<uint32_t>(i);
    file.boxes.push_back(*box);
  }
  for (const JsonValue& object : instances->items) {
    const JsonValue* name = object.find("name");
    if (name)
      file.objects.push_back({name->text, number_of(object, "first_chart"), number_of(object, "charts")});
  }
  return file;
}

}  // namespace kiln
