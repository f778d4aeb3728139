#include "coordinator/scene/import/area_lights.h"

#include <algorithm>

#include "common/base/format.h"
#include "coordinator/scene/import/lights.h"
#include "coordinator/scene/import/records.h"

namespace kiln {
namespace {

// How far from a right angle, and from each other in length, axes may be that a file meant to be equal.
// Exporters write five or six digits; a corner of a lamp of 1 m is then 0.1 mm off at most.
constexpr double kSkew = 1e-4;

struct Shape {
  std::string_view name, size_key;
  size_t size_numbers;
  std::string_view size_words;
};
constexpr Shape kShapes[] = {{"rectangle", "size", 2, "two numbers of metres above 0, its width and height"},
                             {"disc", "radius", 1, "a number of metres above 0"}};
constexpr std::string_view kCommonKeys[] = {"shape", "radiance", "sides", "bake"};

class AreaLightReader {
 public:
  AreaLightReader(const ImportContext& context, const PlacedNode& at, const GltfValue& light)
      : context_(context), at_(at), light_(light), who_(node_name(context, at.node)) {}

  Expected<Record> read() {
    if (light_.kind != GltfValue::Kind::kObject) return bad("", "it is no object");
    const GltfValue* word = light_.find("shape");
    const auto* shape = std::find_if(std::begin(kShapes), std::end(kShapes),
                                     [&](const Shape& s) { return word && word->word == s.name; });
    if (shape == std::end(kShapes))
      return bad(".shape", word ? text("it is '{}'; it may be rectangle or disc", word->word)
                                : "it is missing; it may be rectangle or disc");
    KILN_TRY_STATUS(check_keys(*shape));
    Record record;
    record.type = shape->name;
    const std::string& name = context_.model.nodes[at_.node].name;
    record.name = name.empty() ? who_ : name;
    KILN_TRY_STATUS(put_place(*shape, record));
    KILN_TRY_STATUS(put_light(record));
    return record;
  }

 private:
  tl::unexpected<Error> bad(std::string_view key, const std::string& what) const {
    return context_.bad(text("{}: extras.kiln.light{}: {}", who_, key, what));
  }

  Status check_keys(const Shape& shape) const {
    for (const auto& [key, value] : light_.members)
      if (key != shape.size_key &&
          std::find(std::begin(kCommonKeys), std::end(kCommonKeys), key) == std::end(kCommonKeys))
        return bad("", text("a {} has no '{}'; it has {}, radiance, sides and bake", shape.name, key,
                            shape.size_key));
    return {};
  }

  // The size of the file, by the key of the shape.
  Expected<std::vector<double>> read_size(const Shape& shape) const {
    const GltfValue* value = light_.find(std::string(shape.size_key));
    std::vector<double> size;
    if (value && value->kind == GltfValue::Kind::kNumber) size = {value->number};
    if (value && value->kind == GltfValue::Kind::kArray) size = value->numbers(0).value_or(size);
    if (size.size() != shape.size_numbers ||
        std::any_of(size.begin(), size.end(), [](double s) { return !(s > 0); }))
      return bad(text(".{}", shape.size_key), text("it has to be {}", shape.size_words));
    return size;
  }

  // Size in the world and a rigid transform.
  Status put_place(const Shape& shape, Record& record) const {
    KILN_TRY(std::vector<double> size, read_size(shape));
    const Affine& m = at_.to_world;
    if (is_singular(m))
      return bad("", "the node's transform leaves the light no plane: take away scales of 0");
    const double x = length(m.x), y = length(m.y);
    const DVec3 along = m.x / x, across = m.y / y;
    if (std::abs(dot(along, across)) > kSkew)
      return bad("",
                 text("the node's transform shears the {}: its x and y axes have to stay at right angles. "
                      "Apply the scale of the nodes above it, or put the light below another node",
                      shape.name));
    if (shape.size_numbers == 1 && std::abs(x - y) > kSkew * std::max(x, y))
      return bad("",
                 text("the node's transform makes an ellipse of the disc, with scales {:.6g} and {:.6g} of x "
                      "and y: scale both alike, or use a rectangle",
                      x, y));
    if (shape.size_numbers == 1)
      size[0] *= std::sqrt(x * y);
    else
      size[0] *= x, size[1] *= y;
    for (const double s : size)
      if (!(static_cast<float>(s) > 0) || !std::isfinite(static_cast<float>(s * s)))
        return bad(text(".{}", shape.size_key),
                   text("with the node's scale it is {} m, which is no size", s));
    const DVec3 normal = glm::normalize(cross(along, across));
    const DVec3 z = dot(normal, m.z) < 0 ? -normal : normal;
    record.to_world = Mat4x3(Vec3(along), Vec3(cross(z, along)), Vec3(z), Vec3(m.origin));
    put_numbers(record, std::string(shape.size_key), size);
    return {};
  }

  Status put_light(Record& record) const {
    const auto radiance = light_.numbers("radiance", 3).value_or(std::vector<double>());
    const auto usable = [](double c) { return c >= 0 && std::isfinite(static_cast<float>(c)); };
    if (radiance.size() != 3 || !std::all_of(radiance.begin(), radiance.end(), usable) ||
        !(static_cast<float>(std::max({radiance[0], radiance[1], radiance[2]})) > 0))
      return bad(
          ".radiance",
          "it has to be three finite numbers of at least 0, one of them above 0. A light that is not to "
          "shine says \"bake\": \"none\"");
    put_numbers(record, "radiance", radiance);
    const GltfValue* sides = light_.find("sides");
    if (sides && (sides->kind != GltfValue::Kind::kNumber || (sides->number != 1 && sides->number != 2)))
      return bad(".sides", "it may be 1 or 2");
    put_numbers(record, "sides", {sides ? sides->number : 1});
    std::string word;
    if (const GltfValue* bake = light_.find("bake")) {
      word = bake->word;
      if (word != "full" && word != "indirect" && word != "none")
        return bad(".bake", "it may be full, indirect or none");
    }
    KILN_TRY(const std::string node_word, bake_word(context_, who_, context_.model.nodes[at_.node].extras));
    if (!node_word.empty()) word = node_word;
    put_word(record, "bake", word.empty() ? "full" : word);
    return {};
  }

  const ImportContext& context_;
  const PlacedNode& at_;
  const GltfValue& light_;
  const std::string who_;
};

}  // namespace

Expected<std::vector<PlacedLight>> read_area_lights(const ImportContext& context,
                                                    const std::vector<PlacedNode>& nodes) {
  std::vector<PlacedLight> lights;
  for (const PlacedNode& at : nodes) {
    const GltfValue* kiln = context.model.nodes[at.node].extras.find("kiln");
    const GltfValue* light = kiln ? kiln->find("light") : nullptr;
    if (!light) continue;
    KILN_TRY(Record record, AreaLightReader(context, at, *light).read());
    KILN_TRY_STATUS(take_light(context, record));
    lights.push_back({at.node, std::move(record)});
  }
  return lights;
}

}  // namespace kiln
