#include "coordinator/scene/import/part_extras.h"

#include <algorithm>
#include <array>
#include <optional>

#include "common/base/format.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;

struct PartKey {
  const char* name;
  bool Instance::*part;
  const char* without;  // the note for objects set to false
};
constexpr PartKey kParts[] = {
    {"receive", &Instance::receive, "get no texels (extras.kiln.receive)"},
    {"cast", &Instance::cast, "block no light (extras.kiln.cast)"},
    {"reflect", &Instance::reflect,
     "are black to light: they reflect and emit nothing (extras.kiln.reflect)"},
};
constexpr size_t kPartCount = std::size(kParts);

// Keys of extras.kiln on nodes, meshes and materials read elsewhere, and those that scene.glb and
// scene_instanced.glb write.
constexpr std::string_view kOthers[] = {"bake",  "baked",       "density",        "light", "lod_distance",
                                        "proxy", "first_chart", "texcoord_space", "value", "probes"};

using Said = std::array<std::optional<bool>, kPartCount>;

class PartReader {
 public:
  explicit PartReader(const ImportContext& context) : context_(context) {}

  Expected<Said> read(const std::string& who, const GltfValue& extras) {
    Said said;
    const GltfValue* kiln = extras.find("kiln");
    if (!kiln) return said;
    for (const auto& [name, value] : kiln->members) {
      const auto key = std::find_if(std::begin(kParts), std::end(kParts),
                                    [&name = name](const PartKey& k) { return name == k.name; });
      if (key == std::end(kParts)) {
        if (std::find(std::begin(kOthers), std::end(kOthers), name) == std::end(kOthers))
          unknown_.add(text("{} ('{}')", who, name));
        continue;
      }
      if (value.kind != GltfValue::Kind::kFlag)
        return context_.bad(
            text("{}: extras.kiln.{} is {}; it may be true or false", who, name, shown(value)));
      said[static_cast<size_t>(key - std::begin(kParts))] = value.number != 0;
    }
    return said;
  }
  const Finding& unknown() const { return unknown_; }

 private:
  static std::string shown(const GltfValue& value) {
    if (value.kind == GltfValue::Kind::kNumber) return text("{}", value.number);
    if (value.kind == GltfValue::Kind::kWord) return text("'{}'", value.word);
    return "no boolean";
  }

  const ImportContext& context_;
  Finding unknown_;
};

// `over` where it is set.
Said merged(const Said& under, const Said& over) {
  Said out = under;
  for (size_t k = 0; k < kPartCount; ++k)
    if (over[k]) out[k] = over[k];
  return out;
}

void note_parts(const Scene& scene, ImportNotes& notes) {
  for (const PartKey& key : kParts) {
    Finding without;
    for (const Instance& i : scene.instances)
      if (!(i.*key.part)) without.add("'" + i.name + "'");
    if (!without.empty())
      add_note(notes, Kind::kNote, text("{}: {}", key.without, without.list("object", "objects")));
  }
}

}  // namespace

Status read_parts(const ImportContext& context, const std::vector<PlacedNode>& nodes, Scene& scene,
                  ImportNotes& notes) {
  const GltfModel& model = context.model;
  PartReader reader(context);
  std::vector<Said> of_node(model.nodes.size()), of_mesh, of_material;
  for (const PlacedNode& at : nodes) {
    KILN_TRY(const Said own, reader.read(node_name(context, at.node), model.nodes[at.node].extras));
    of_node[at.node] = merged(of_node[at.node], own);
    for (const int child : model.nodes[at.node].children)
      of_node[static_cast<size_t>(child)] = of_node[at.node];
  }
  for (size_t m = 0; m < model.meshes.size(); ++m) {
    KILN_TRY(const Said own, reader.read(element("mesh", m, model.meshes[m].name), model.meshes[m].extras));
    of_mesh.push_back(own);
  }
  for (size_t m = 0; m < model.materials.size(); ++m) {
    KILN_TRY(const Said own,
             reader.read(element("material", m, model.materials[m].name), model.materials[m].extras));
    of_material.push_back(own);
  }
  for (Instance& i : scene.instances) {
    Said said = merged(of_node[i.node], of_mesh[i.file_mesh]);
    const int material = model.meshes[i.file_mesh].primitives[i.file_primitive].material;
    if (material >= 0) said = merged(said, of_material[static_cast<size_t>(material)]);
    for (size_t k = 0; k < kPartCount; ++k) i.*kParts[k].part = said[k].value_or(true);
  }
  if (!reader.unknown().empty())
    add_note(
        notes, Kind::kWarning,
        text(
            "keys of extras.kiln that Kiln does not know are left out; docs/gltf.md lists those it knows: {}",
            reader.unknown().list("element", "elements")));
  note_parts(scene, notes);
  return {};
}

}  // namespace kiln
