#include "common/atlas/previous_layout.h"

#include <map>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/hash.h"

namespace kiln {
namespace {

uint64_t pose_of(const Instance& instance) {
  float m[12];
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) m[3 * column + row] = instance.to_world[column][row] + 0.0f;  // -0 is 0
  return xxh3(std::as_bytes(std::span(m)));
}

// By instance: index of its object in the previous layout, or none.
constexpr uint32_t kNone = ~0u;
std::vector<uint32_t> earlier_objects(const Scene& scene, const PreviousLayout& previous) {
  using Pose = std::pair<std::string, uint64_t>;
  std::map<Pose, std::vector<uint32_t>> by_pose;  // last first
  std::map<std::string, std::vector<uint32_t>> by_name;
  for (uint32_t o = static_cast<uint32_t>(previous.objects.size()); o-- > 0;) {
    by_pose[{previous.objects[o].name, previous.objects[o].pose}].push_back(o);
    by_name[previous.objects[o].name].push_back(o);
  }
  std::vector<uint32_t> found(scene.instances.size(), kNone);
  std::vector<bool> taken(previous.objects.size());
  for (size_t i = 0; i < found.size(); ++i) {
    const auto at = by_pose.find({object_key(scene, i), pose_of(scene.instances[i])});
    if (at == by_pose.end() || at->second.empty()) continue;
    found[i] = at->second.back();
    at->second.pop_back();
    taken[found[i]] = true;
  }
  for (size_t i = 0; i < found.size(); ++i) {
    if (found[i] != kNone) continue;
    const auto at = by_name.find(object_key(scene, i));
    if (at == by_name.end()) continue;
    std::vector<uint32_t>& objects = at->second;
    while (!objects.empty() && taken[objects.back()]) objects.pop_back();
    if (objects.empty()) continue;
    found[i] = objects.back();
    objects.pop_back();
  }
  return found;
}

}  // namespace

std::string object_key(const Scene& scene, size_t instance) {
  const Instance& i = scene.instances[instance];
  const std::string node = i.name.empty() ? text("node {}", i.node) : i.name;
  return text("{}/{}/{}", node, scene.meshes[i.mesh].name, i.file_primitive);
}

PreviousLayout previous_layout_of(const Scene& scene, const Atlas& atlas) {
  KILN_CHECK(atlas.packed);
  PreviousLayout layout{atlas.width, atlas.height, atlas.pages, {}};
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const auto first = atlas.packed_charts.begin() + atlas.instance_first_chart[i];
    layout.objects.push_back({object_key(scene, i),
                              pose_of(scene.instances[i]),
                              {first, first + atlas.of_instance(i).chart_count}});
  }
  return layout;
}

PreviousPlaces match_previous(const Scene& scene, const Atlas& atlas, const std::vector<uint64_t>& keys,
                              const PreviousLayout& previous) {
  PreviousPlaces places{previous.width, previous.height, previous.pages, {}};
  places.places.resize(keys.size());
  const std::vector<uint32_t> earlier = earlier_objects(scene, previous);
  for (size_t i = 0; i < earlier.size(); ++i) {
    if (earlier[i] == kNone) continue;
    const std::vector<PackedChart>& charts = previous.objects[earlier[i]].charts;
    const size_t count = std::min<size_t>(charts.size(), atlas.of_instance(i).chart_count);
    for (size_t c = 0; c < count; ++c) {
      const size_t p = atlas.instance_first_chart[i] + c;
      if (charts[c].key == keys[p])
        places.places[p] = PackPlace{charts[c].x, charts[c].y, charts[c].page, charts[c].turned != 0};
    }
  }
  return places;
}

}  // namespace kiln
