// A charts.json may come from anywhere: every field read is checked, and no number in it decides
// how much memory is allocated.
#include <charconv>
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/output/chart_table/chart_table.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kMaxFile = uint64_t{1} << 31;
constexpr uint32_t kMaxSide = 16384, kMaxPages = 64;  // as for --page-size and the packer
constexpr uint32_t kAny = ~0u;

class LayoutReader {
 public:
  explicit LayoutReader(std::string name) : name_(std::move(name)) {}

  Expected<PreviousLayout> read(const Json& root) {
    if (!root.is_object() || root.value("format", Json()) != Json("kiln charts"))
      return bad("format", "is not 'kiln charts'");
    KILN_TRY(const uint32_t version, number(root, "version", "version", 0, kAny));
    if (version != 1) return bad("version", text("is {}, this program reads 1", version));
    PreviousLayout layout;
    KILN_TRY(layout.width, number(root, "width", "width", 1, kMaxSide));
    KILN_TRY(layout.height, number(root, "height", "height", 1, kMaxSide));
    KILN_TRY(layout.pages, number(root, "pages", "pages", 1, kMaxPages));
    KILN_TRY(const Json* places, array(root, "layout"));
    KILN_TRY(const Json* instances, array(root, "instances"));
    std::vector<PackedChart> charts;
    for (size_t i = 0; i < places->size(); ++i) {
      KILN_TRY(const PackedChart chart, place((*places)[i], text("layout[{}]", i), layout));
      charts.push_back(chart);
    }
    size_t used = 0;
    for (size_t i = 0; i < instances->size(); ++i)
      KILN_TRY_STATUS(object((*instances)[i], text("instances[{}]", i), charts, used, layout));
    if (used != charts.size())
      return bad("layout", text("has {} charts, the instances have {}", charts.size(), used));
    return layout;
  }

 private:
  tl::unexpected<Error> bad(const std::string& field, const std::string& what) const {
    return fail(
        ErrorKind::kInvalidInput,
        text("{}: {} {}: --keep-layout needs the charts.json of an earlier bake", name_, field, what));
  }

  // A member of an object or, if `at` is a number, an element of an array.
  template <class At>
  Expected<uint32_t> number(const Json& in, const At& at, const std::string& field, uint32_t low,
                            uint32_t high) const {
    const Json* value = find(in, at);
    if (!value) return bad(field, "is missing");
    if (!value->is_number_unsigned()) return bad(field, "is not a whole number");
    const uint64_t v = value->get<uint64_t>();
    if (v < low || v > high) return bad(field, text("is {}, outside {} to {}", v, low, high));
    return static_cast<uint32_t>(v);
  }

  template <class At>
  Expected<uint64_t> hex(const Json& in, const At& at, const std::string& field) const {
    const Json* value = find(in, at);
    if (!value) return bad(field, "is missing");
    uint64_t v = 0;
    const std::string* digits = value->get_ptr<const std::string*>();
    if (!digits || digits->size() != 16 ||
        std::from_chars(digits->data(), digits->data() + 16, v, 16).ptr != digits->data() + 16)
      return bad(field, "is not 16 hexadecimal digits");
    return v;
  }

  static const Json* find(const Json& in, const char* key) {
    const auto at = in.find(key);
    return at == in.end() ? nullptr : &*at;
  }
  static const Json* find(const Json& in, size_t index) { return index < in.size() ? &in[index] : nullptr; }

  Expected<const Json*> array(const Json& root, const char* key) const {
    const Json* value = find(root, key);
    if (!value || !value->is_array()) return bad(key, "is not an array");
    return value;
  }

  Expected<PackedChart> place(const Json& row, const std::string& field, const PreviousLayout& in) const {
    if (!row.is_array() || row.size() != 5) return bad(field, "is not [key, x, y, page, turned]");
    PackedChart chart;
    KILN_TRY(chart.key, hex(row, size_t{0}, field + "[0]"));
    KILN_TRY(chart.x, number(row, size_t{1}, field + "[1]", 0, in.width - 1));
    KILN_TRY(chart.y, number(row, size_t{2}, field + "[2]", 0, in.height - 1));
    KILN_TRY(chart.page, number(row, size_t{3}, field + "[3]", 0, in.pages - 1));
    KILN_TRY(chart.turned, number(row, size_t{4}, field + "[4]", 0, 1));
    return chart;
  }

  // Reads the instance's charts; those before `used` are taken already.
  Status object(const Json& in, const std::string& field, const std::vector<PackedChart>& charts,
                size_t& used, PreviousLayout& layout) const {
    if (!in.is_object()) return bad(field, "is not an object");
    PreviousLayout::Object made;
    const Json* key = find(in, "key");
    if (!key || !key->is_string()) return bad(field + ".key", "is not a text");
    made.name = key->get<std::string>();
    KILN_TRY(made.pose, hex(in, "pose", field + ".pose"));
    KILN_TRY(const uint32_t first, number(in, "first_chart", field + ".first_chart", 0, kAny));
    KILN_TRY(const uint32_t count, number(in, "charts", field + ".charts", 0, kAny));
    if (first != used || count > charts.size() - used)
      return bad(field + ".first_chart",
                 text("{} and its {} charts do not follow the {} before it in a layout of {}", first, count,
                      used, charts.size()));
    const auto begin = charts.begin() + static_cast<std::ptrdiff_t>(used);
    made.charts.assign(begin, begin + count);
    used += count;
    layout.objects.push_back(std::move(made));
    return {};
  }

  std::string name_;
};

}  // namespace

Expected<KeptLayout> read_layout(const std::filesystem::path& path) {
  KILN_TRY(const Bytes file, read_file(path, kMaxFile));
  const auto* begin = reinterpret_cast<const char*>(file.data());
  const Json root = Json::parse(begin, begin + file.size(), nullptr, false);
  if (root.is_discarded())
    return fail(ErrorKind::kInvalidInput,
                text("{}: its JSON does not parse: --keep-layout needs the charts.json of an earlier bake",
                     path.string()));
  KILN_TRY(PreviousLayout layout, LayoutReader(path.string()).read(root));
  return KeptLayout{std::move(layout), sha256(file)};
}

}  // namespace kiln
