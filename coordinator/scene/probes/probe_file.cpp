// The file of --probes.
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/scene/probes/probes.h"

namespace kiln {
namespace {

constexpr size_t kMostVolumes = 256;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {}

  Expected<std::vector<ProbeBox>> read(std::string_view content) {
    const Expected<JsonValue> parsed = parse_json(content);
    if (!parsed) return bad(parsed.error().message);
    const JsonValue* const version = parsed->find("version");
    if (!version || version->kind != JsonValue::Kind::kNumber || version->number != 1)
      return bad("its version is not 1, the only one that this release reads");
    const JsonValue* const volumes = parsed->find("volumes");
    if (!volumes || volumes->kind != JsonValue::Kind::kList || volumes->items.empty())
      return bad("\"volumes\" is not a list with at least one volume");
    if (volumes->items.size() > kMostVolumes)
      return bad(text("it has {} volumes, {} is the most", volumes->items.size(), kMostVolumes));
    std::vector<ProbeBox> boxes;
    for (const JsonValue& v : volumes->items) {
      KILN_TRY(const ProbeBox box, read_box(v, boxes.size()));
      boxes.push_back(box);
    }
    return boxes;
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return fail(ErrorKind::kInvalidInput, text("{}: {}", path_.string(), what));
  }

  Expected<ProbeBox> read_box(const JsonValue& v, size_t index) {
    if (v.kind != JsonValue::Kind::kObject) return bad(text("volume {} is no object", index));
    for (const JsonMember& m : v.members)
      if (m.first != "name" && m.first != "min" && m.first != "max" && m.first != "spacing" &&
          m.first != "max_spacing" && m.first != "visibility")
        return bad(text("volume {} has \"{}\"; there are name, min, max, spacing, max_spacing and visibility",
                        index, m.first));
    ProbeBox box;
    box.name = text("volume {}", index);
    if (const JsonValue* name = v.find("name")) {
      if (name->kind != JsonValue::Kind::kText) return bad(text("volume {}: its name is no text", index));
      box.name = name->text;
    }
    if (!corner(v, "min", box.low) || !corner(v, "max", box.high))
      return bad(text("volume '{}': min and max are not [x, y, z] in metres", box.name));
    if (!number(v, "spacing", box.spacing)) return bad(text("volume '{}': it has no spacing", box.name));
    box.max_spacing = box.spacing;
    if (v.find("max_spacing") && !number(v, "max_spacing", box.max_spacing))
      return bad(text("volume '{}': its max_spacing is no number", box.name));
    if (const JsonValue* flag = v.find("visibility")) {
      if (flag->kind != JsonValue::Kind::kFlag)
        return bad(text("volume '{}': visibility is not true or false", box.name));
      box.visibility = flag->flag;
    }
    if (const std::string fault = fault_of(box); !fault.empty()) return bad(fault);
    return box;
  }

  static bool number(const JsonValue& v, std::string_view name, double& out) {
    const JsonValue* const n = v.find(name);
    if (!n || n->kind != JsonValue::Kind::kNumber) return false;
    out = n->number;
    return true;
  }
  static bool corner(const JsonValue& v, std::string_view name, DVec3& out) {
    const JsonValue* const list = v.find(name);
    if (!list || list->kind != JsonValue::Kind::kList || list->items.size() != 3) return false;
    for (int k = 0; k < 3; ++k) {
      const JsonValue& item = list->items[static_cast<size_t>(k)];
      if (item.kind != JsonValue::Kind::kNumber) return false;
      out[k] = item.number;
    }
    return true;
  }

  const std::filesystem::path& path_;
};

}  // namespace

Expected<std::vector<ProbeBox>> read_probe_file(const std::filesystem::path& path) {
  KILN_TRY(const Bytes bytes, read_file(path));
  return Reader(path).read({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace kiln
