#include "coordinator/scene/import/probe_extras.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMostVolumes = 256;

// Whether the axes stay axes, in any order.
bool keeps_axes(const Affine& m) {
  for (const DVec3& axis : {m.x, m.y, m.z}) {
    const DVec3 a = glm::abs(axis);
    const double most = std::max({a.x, a.y, a.z});
    if (a.x + a.y + a.z > most * (1 + 1e-6)) return false;
  }
  return true;
}

Expected<ProbeBox> read_box(const ImportContext& context, const PlacedNode& at, const GltfValue& v) {
  const std::string who = node_name(context, at.node) + ": extras.kiln.probes";
  const auto low = v.numbers("min", 3), high = v.numbers("max", 3);
  if (!low || !high) return context.bad(who + " has no \"min\" and \"max\" of three numbers each");
  for (const auto& [name, value] : v.members) {
    const bool number = name == "spacing" || name == "max_spacing";
    if (!number && name != "min" && name != "max" && name != "visibility" && name != "name")
      return context.bad(
          text("{} has \"{}\"; there are name, min, max, spacing, max_spacing and visibility", who, name));
    if (number && value.kind != GltfValue::Kind::kNumber)
      return context.bad(text("{}: its {} is no number", who, name));
    if (name == "visibility" && value.kind != GltfValue::Kind::kFlag)
      return context.bad(text("{}: its visibility is not true or false", who));
  }
  ProbeBox box;
  const GltfValue* const name = v.find("name");
  box.name = name && name->kind == GltfValue::Kind::kWord ? name->word : context.model.nodes[at.node].name;
  if (box.name.empty()) box.name = text("node {}", at.node);
  for (size_t k = 0; k < 3; ++k)
    if (!((*low)[k] < (*high)[k]))
      return context.bad(text("{}: its box has no volume: along {} it goes from {:g} to {:g}", who, "xyz"[k],
                              (*low)[k], (*high)[k]));
  for (int corner = 0; corner < 8; ++corner) {
    DVec3 p;
    for (int k = 0; k < 3; ++k) p[k] = (corner >> k & 1 ? *high : *low)[static_cast<size_t>(k)];
    p = at.to_world.point(p);
    box.low = corner ? glm::min(box.low, p) : p;
    box.high = corner ? glm::max(box.high, p) : p;
  }
  box.spacing = v.number_or("spacing", 1);
  box.max_spacing = v.number_or("max_spacing", box.spacing);
  const GltfValue* const flag = v.find("visibility");
  box.visibility = flag && flag->number != 0;
  box.node = at.node;
  if (const std::string fault = fault_of(box); !fault.empty()) return context.bad(who + ": " + fault);
  return box;
}

}  // namespace

Expected<std::vector<ProbeBox>> read_probe_boxes(const ImportContext& context,
                                                 const std::vector<PlacedNode>& nodes, ImportNotes& notes) {
  std::vector<ProbeBox> boxes;
  Finding turned;
  for (const PlacedNode& at : nodes) {
    const GltfValue* const kiln = context.model.nodes[at.node].extras.find("kiln");
    const GltfValue* const wish = kiln ? kiln->find("probes") : nullptr;
    if (!wish) continue;
    if (wish->kind != GltfValue::Kind::kObject)
      return context.bad(text("{}: extras.kiln.probes is no object", node_name(context, at.node)));
    KILN_TRY(const ProbeBox box, read_box(context, at, *wish));
    if (!keeps_axes(at.to_world)) turned.add(node_name(context, at.node));
    boxes.push_back(box);
    if (boxes.size() > kMostVolumes)
      return context.bad(text("more than {} nodes have extras.kiln.probes", kMostVolumes));
  }
  if (!turned.empty())
    add_note(notes, ImportNote::Kind::kApproximated,
             text("probe volumes follow the axes of the world, around the boxes of {}",
                  turned.list("turned node", "turned nodes")));
  return boxes;
}

}  // namespace kiln
