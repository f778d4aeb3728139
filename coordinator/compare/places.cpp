#include "coordinator/compare/places.h"

#include <optional>

#include "common/base/files.h"
#include "common/base/json.h"

namespace kiln {
namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 26;

double number_of(const JsonValue* v) {
  return v && v->kind == JsonValue::Kind::kNumber ? v->number : -1;
}

double number_of(const JsonValue& object, const char* key) {
  return number_of(object.find(key));
}

// A row of "transforms": scale x and y, offset x and y, page, turned; of the page as [0, 1]^2.
struct Box {
  double width, height, left, top, page;
};

std::optional<Box> box_of(const JsonValue& row) {
  if (row.items.size() != 6) return std::nullopt;
  const auto at = [&](size_t i) { return number_of(&row.items[i]); };
  return Box{at(0), at(1), at(2), at(3), at(4)};
}

// The name of the object whose chart has this number.
std::string owner_of(const JsonValue& instances, double chart) {
  for (const JsonValue& object : instances.items) {
    const double first = number_of(object, "first_chart");
    const JsonValue* name = object.find("name");
    if (name && first >= 0 && chart >= first && chart < first + number_of(object, "charts"))
      return name->text;
  }
  return {};
}

}  // namespace

void name_places(const std::filesystem::path& folder, std::span<WorstTexel> texels) {
  const auto bytes = read_file(folder / "charts.json", kMostBytes);
  if (!bytes) return;
  const auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!json) return;
  const JsonValue *charts = json->find("transforms"), *instances = json->find("instances");
  const double width = number_of(*json, "width"), height = number_of(*json, "height");
  if (!charts || !instances || !(width > 0) || !(height > 0)) return;
  for (WorstTexel& t : texels) {
    double least = 2;
    for (size_t i = 0; i < charts->items.size(); ++i) {
      const std::optional<Box> box = box_of(charts->items[i]);
      if (!box || box->page != t.page) continue;
      // A texel belongs to a chart that reaches into it.
      const bool inside = (t.x + 1) / width > box->left && t.x / width < box->left + box->width &&
                          (t.y + 1) / height > box->top && t.y / height < box->top + box->height;
      if (!inside || box->width * box->height >= least) continue;
      least = box->width * box->height;
      t.object = owner_of(*instances, static_cast<double>(i));
    }
  }
}

}  // namespace kiln
