#include "coordinator/scene/import/density_extras.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMaxBoxes = 256;

class DensityReader {
 public:
  explicit DensityReader(const ImportContext& context) : context_(context) {}

  // The value of an object {"density": f}; 1 where it has none.
  Expected<double> factor(const std::string& who, const GltfValue* object) {
    const GltfValue* value = object ? object->find("density") : nullptr;
    if (!value) return 1.0;
    if (value->kind != GltfValue::Kind::kNumber || !(value->number > 0) || !std::isfinite(value->number))
      return context_.bad(
          text("{}: extras.kiln.density is {}; it may be a number above 0", who, shown(*value)));
    said_ = true;
    return clamped(who, value->number);
  }

  double clamped(const std::string& who, double factor) {
    const double in = std::clamp(factor, kMinDensityFactor, kMaxDensityFactor);
    if (in != factor) clamped_.add(text("{} ({:.3g})", who, factor));
    return in;
  }

  void put_notes(ImportNotes& notes) const {
    if (!clamped_.empty())
      add_note(
          notes, ImportNote::Kind::kApproximated,
          text("extras.kiln.density is clamped to 1/64 to 64 for {}", clamped_.list("element", "elements")));
  }
  bool said() const { return said_; }

 private:
  static std::string shown(const GltfValue& value) {
    switch (value.kind) {
      case GltfValue::Kind::kNumber:
        return text("{}", value.number);
      case GltfValue::Kind::kWord:
        return text("'{}'", value.word);
      default:
        return "no number";
    }
  }

  const ImportContext& context_;
  Finding clamped_;
  bool said_ = false;
};

Expected<ImportanceBox> read_box(const ImportContext& context, const std::string& who, const GltfValue& entry,
                                 DensityReader& reader) {
  const GltfValue* box = entry.find("box");
  const auto low = box ? box->numbers("min", 3) : std::nullopt,
             high = box ? box->numbers("max", 3) : std::nullopt;
  if (!low || !high)
    return context.bad(text("{}: box is not {{\"min\": [x, y, z], \"max\": [x, y, z]}}", who));
  ImportanceBox out;
  for (int k = 0; k < 3; ++k) {
    out.low[k] = (*low)[static_cast<size_t>(k)];
    out.high[k] = (*high)[static_cast<size_t>(k)];
    if (!(out.low[k] <= out.high[k]))  // JSON has no NaN or infinity
      return context.bad(text("{}: its box has min {} above max {}", who, out.low[k], out.high[k]));
  }
  if (!entry.find("density")) return context.bad(text("{}: it has no density", who));
  KILN_TRY(out.factor, reader.factor(who, &entry));
  return out;
}

Expected<std::vector<ImportanceBox>> read_boxes(const ImportContext& context, DensityReader& reader) {
  std::vector<ImportanceBox> boxes;
  KILN_TRY(const GltfScene* scene, baked_scene(context));
  const GltfValue* kiln = scene ? scene->extras.find("kiln") : nullptr;
  const GltfValue* list = kiln ? kiln->find("importance") : nullptr;
  if (!list) return boxes;
  const std::string who = "extras.kiln.importance of the scene";
  if (list->kind != GltfValue::Kind::kArray) return context.bad(text("{}: it is no list", who));
  if (list->items.size() > kMaxBoxes)
    return context.bad(text("{}: it has {} boxes, {} is the most", who, list->items.size(), kMaxBoxes));
  for (size_t i = 0; i < list->items.size(); ++i) {
    KILN_TRY(const ImportanceBox box,
             read_box(context, text("{}, entry {}", who, i), list->items[i], reader));
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace

Expected<DensityWishes> read_density(const ImportContext& context, const std::vector<PlacedNode>& nodes,
                                     const Scene& scene, ImportNotes& notes) {
  const GltfModel& model = context.model;
  const auto kiln = [](const GltfValue& extras) { return extras.find("kiln"); };
  DensityReader reader(context);
  std::vector<double> of_node(model.nodes.size(), 1), of_mesh, of_material;
  for (const PlacedNode& at : nodes) {  // parents first
    KILN_TRY(const double own, reader.factor(node_name(context, at.node), kiln(model.nodes[at.node].extras)));
    of_node[at.node] *= own;  // 0 or infinite in trees deep enough, which is clamped below like any other
    for (const int child : model.nodes[at.node].children)
      of_node[static_cast<size_t>(child)] = of_node[at.node];
  }
  for (size_t m = 0; m < model.meshes.size(); ++m) {
    KILN_TRY(const double own,
             reader.factor(element("mesh", m, model.meshes[m].name), kiln(model.meshes[m].extras)));
    of_mesh.push_back(own);
  }
  for (size_t m = 0; m < model.materials.size(); ++m) {
    KILN_TRY(const double own,
             reader.factor(element("material", m, model.materials[m].name), kiln(model.materials[m].extras)));
    of_material.push_back(own);
  }
  DensityWishes wishes;
  if (reader.said())
    for (const Instance& i : scene.instances) {
      const int material = model.meshes[i.file_mesh].primitives[i.file_primitive].material;
      const double product = of_node[i.node] * of_mesh[i.file_mesh] *
                             (material < 0 ? 1.0 : of_material[static_cast<size_t>(material)]);
      wishes.by_instance.push_back(
          static_cast<float>(reader.clamped("the product for '" + i.name + "'", product)));
    }
  KILN_TRY(wishes.boxes, read_boxes(context, reader));
  reader.put_notes(notes);
  return wishes;
}

}  // namespace kiln
