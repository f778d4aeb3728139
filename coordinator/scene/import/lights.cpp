#include "coordinator/scene/import/lights.h"

#include "common/base/format.h"
#include "coordinator/scene/import/records.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
constexpr const char* kPunctual = "KHR_lights_punctual";
constexpr double kHalfPi = 1.57079632679489661923;

// Cone half angles with 0 <= inner < outer <= pi/2, as the extension requires.
void put_cone(const GltfLight& light, const std::string& who, Record& record, ImportNotes& notes) {
  double inner = light.inner, outer = light.outer;
  if (!(outer > 0 && outer <= kHalfPi && inner >= 0 && inner < outer)) {
    add_note(notes, Kind::kApproximated,
             text("{}: cone angles {} and {} are clamped to 0 <= inner < outer <= pi/2", who, inner, outer));
    outer = std::clamp(outer, 1e-3, kHalfPi);
    inner = std::clamp(inner, 0.0, outer * 0.999);
  }
  put_numbers(record, "inner", {inner});
  put_numbers(record, "outer", {outer});
}

Expected<Record> read_light(const ImportContext& context, uint32_t node, size_t index, ImportNotes& notes) {
  const GltfLight& light = context.model.lights[index];
  const std::string who = element("light", index, light.name);
  Record record;
  record.type = light.type;
  record.name = !light.name.empty() ? light.name : node_name(context, node);
  if (light.type != "directional" && light.type != "point" && light.type != "spot")
    return context.bad(text("{}: type '{}' does not exist", who, light.type));
  std::vector<double> color = light.color.empty() ? std::vector<double>{1, 1, 1} : light.color;
  if (color.size() != 3) return context.bad(text("{}: its color has {} numbers", who, color.size()));
  for (const double c : color)
    if (!(c >= 0) || !std::isfinite(static_cast<float>(c)))
      return context.bad(text("{}: its color has the component {}", who, c));
  if (!(light.intensity >= 0) || !std::isfinite(static_cast<float>(light.intensity)))
    return context.bad(text("{}: intensity {} is not a valid intensity", who, light.intensity));
  put_numbers(record, "color", color);
  put_numbers(record, "intensity", {light.intensity});
  if (light.type == "directional") put_numbers(record, "angle", {context.settings.sun_angle});
  if (light.type != "directional" && light.range > 0) put_numbers(record, "range", {light.range});
  if (light.type == "spot") put_cone(light, who, record, notes);
  KILN_TRY(std::string word, bake_word(context, who, light.extras));
  KILN_TRY(const std::string node_word,
           bake_word(context, node_name(context, node), context.model.nodes[node].extras));
  if (!node_word.empty()) word = node_word;
  put_word(record, "bake", word.empty() ? "full" : word);
  return record;
}

bool is_dark(const Record& light) {
  const auto& color = light.find("color")->numbers;
  return light.find("intensity")->numbers[0] == 0 || (color[0] == 0 && color[1] == 0 && color[2] == 0);
}

}  // namespace

Expected<std::string> bake_word(const ImportContext& context, const std::string& who,
                                const GltfValue& extras) {
  const GltfValue* kiln = extras.find("kiln");
  const GltfValue* bake = kiln ? kiln->find("bake") : nullptr;
  if (!bake) return std::string();
  if (bake->word != "full" && bake->word != "indirect" && bake->word != "none")
    return context.bad(
        text("{}: extras.kiln.bake is '{}'; it may be full, indirect or none", who, bake->word));
  return bake->word;
}

Status take_light(const ImportContext& context, const Record& light) {
  constexpr uint64_t kLight = 1024;
  uint64_t bytes = kLight + 2 * light.name.size();
  for (const Property& property : light.properties) bytes += property.numbers.size() * sizeof(double);
  return context.document.budget->take(bytes, "its lights");
}

Expected<std::vector<PlacedLight>> read_lights(const ImportContext& context,
                                               const std::vector<PlacedNode>& nodes, ImportNotes& notes) {
  std::vector<PlacedLight> lights;
  Finding dark, aimless;
  for (const PlacedNode& at : nodes) {
    const auto& extensions = context.model.nodes[at.node].extensions;
    const auto extension = extensions.find(kPunctual);
    if (extension == extensions.end()) continue;
    const int index = extension->second.index("light");
    if (index < 0 || static_cast<size_t>(index) >= context.model.lights.size())
      return context.bad(text("{}: light {} does not exist, there are {}", node_name(context, at.node), index,
                              context.model.lights.size()));
    KILN_TRY(Record record, read_light(context, at.node, static_cast<size_t>(index), notes));
    KILN_TRY_STATUS(take_light(context, record));
    const bool aimed = rigid_part(at.to_world, record.to_world);
    if (!aimed) record.to_world[3] = Vec3(at.to_world.origin);
    if (is_dark(record))
      dark.add(node_name(context, at.node));
    else if (!aimed && record.type != "point")
      aimless.add(node_name(context, at.node));
    else
      lights.push_back({at.node, std::move(record)});
  }
  if (!dark.empty())
    add_note(notes, Kind::kIgnored,
             text("lights of intensity 0 are left out, in {}", dark.list("node", "nodes")));
  if (!aimless.empty())
    add_note(notes, Kind::kWarning,
             text("lights whose transform leaves no direction are left out: take away scales of 0, in {}",
                  aimless.list("node", "nodes")));
  return lights;
}

std::vector<Record> sun_lights(const BakeSettings& settings) {
  std::vector<Record> records;
  for (size_t i = 0; i < settings.suns.size(); ++i) {
    const auto& sun = settings.suns[i];
    Record record;
    record.type = "directional";
    record.name = text("sun {}", i);
    // The settings parser guarantees a nonzero direction.
    Affine frame;
    frame.z = DVec3(sun.to_light[0], sun.to_light[1], sun.to_light[2]);
    rigid_part(frame, record.to_world);
    put_numbers(record, "color", {sun.irradiance[0], sun.irradiance[1], sun.irradiance[2]});
    put_numbers(record, "intensity", {1});
    put_numbers(record, "angle", {settings.sun_angle});
    put_word(record, "bake", "full");
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace kiln
