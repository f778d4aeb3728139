// KILN_probes: names the files of probes and the nodes of their volumes (docs/gltf.md, docs/schema).
#include <algorithm>

#include "common/base/format.h"
#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

Json vector_json(const DVec3& v) {
  return {v.x, v.y, v.z};
}

Json root_json(const PublishedProbes& probes) {
  Json out = {{"version", 1},
              {"probes", probes.probes},
              {"volumes", probes.volumes.size()},
              {"layout", {{"uri", "probes.json"}}},
              {"light", {{"uri", "probes.exr"}}}};
  const auto& volumes = probes.volumes;
  if (std::any_of(volumes.begin(), volumes.end(), [](const auto& v) { return v.visibility; })) {
    out["irradiance"] = {{"uri", "probes_irradiance.exr"}};
    out["distance"] = {{"uri", "probes_distance.exr"}};
  }
  return out;
}

Json volume_json(const PublishedProbeVolume& v, size_t index) {
  Json out = {{"volume", index},
              {"min", vector_json(v.low)},
              {"max", vector_json(v.high)},
              {"spacing", v.spacing},
              {"maxSpacing", v.spacing * static_cast<double>(uint64_t{1} << (v.levels - 1))},
              {"visibility", v.visibility}};
  if (v.bevy)
    out["bevy"] = {{"uri", v.bevy->uri},
                   {"translation", vector_json(v.bevy->translation)},
                   {"scale", vector_json(v.bevy->scale)}};
  return out;
}

bool carries_volume(const Json& node) {
  return node.contains("extras") && node["extras"].is_object() && node["extras"].contains("kiln") &&
         node["extras"]["kiln"].is_object() && node["extras"]["kiln"].contains("probes");
}

}  // namespace

void GltfOutput::drop_earlier_probes() {
  const Json nodes = doc.value("nodes", Json::array());
  for (size_t n = 0; n < nodes.size(); ++n) {
    const Json& node = nodes[n];
    const bool stands = node.contains("extensions") && node["extensions"].contains(kKilnProbes);
    if (stands && !node.contains("mesh") && !node.contains("children") && !carries_volume(node))
      probe_nodes_.push_back(n);
  }
  drop_extension(doc, kKilnProbes);
}

void GltfOutput::attach_kiln_probes() {
  if (!c_->probes) return;
  doc["extensions"][kKilnProbes] = root_json(*c_->probes);
  use_extension(doc, kKilnProbes);
  size_t reused = 0;
  for (size_t i = 0; i < c_->probes->volumes.size(); ++i) {
    const PublishedProbeVolume& v = c_->probes->volumes[i];
    size_t node = doc["nodes"].size();
    if (v.node && *v.node < node) {
      node = *v.node;
    } else {
      if (reused < probe_nodes_.size()) {
        node = probe_nodes_[reused++];
      } else {
        doc["nodes"].push_back(Json::object());
        if (doc.contains("scenes")) doc["scenes"][doc.value("scene", 0)]["nodes"].push_back(node);
      }
      doc["nodes"][node]["name"] = text("probes {}", v.name);
    }
    doc["nodes"][node]["extensions"][kKilnProbes] = volume_json(v, i);
  }
}

}  // namespace kiln
