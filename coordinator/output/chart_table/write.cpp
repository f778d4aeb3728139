#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/output/chart_table/chart_table.h"

namespace kiln {
namespace {

// Elements of a JSON array, one per line.
class Lines {
 public:
  explicit Lines(std::string& out) : out_(out) {}
  void add(const std::string& element) {
    out_ += first_ ? "\n    " : ",\n    ";
    out_ += element;
    first_ = false;
  }

 private:
  std::string& out_;
  bool first_ = true;
};

std::string instance_line(const Scene& scene, const Atlas& atlas, size_t i,
                          const PreviousLayout::Object& object) {
  const Instance& in = scene.instances[i];
  return text(
      R"({{"name": {}, "node": {}, "mesh": {}, "primitive": {}, "first_chart": {}, "charts": {}, "chart_set": {}, )"
      R"("key": {}, "pose": "{:016x}"}})",
      json_quote(in.name), in.node, in.file_mesh, in.file_primitive, atlas.instance_first_chart[i],
      atlas.of_instance(i).chart_count, atlas.charts_of_instance[i], json_quote(object.name), object.pose);
}

// The mesh of each set of charts; a set that no instance uses keeps its own number.
std::vector<uint32_t> mesh_of_set(const Scene& scene, const Atlas& atlas) {
  std::vector<uint32_t> mesh(atlas.charts.size(), 0);
  for (uint32_t m = 0; m < scene.meshes.size() && m < mesh.size(); ++m) mesh[m] = m;
  for (size_t i = 0; i < scene.instances.size(); ++i)
    mesh[atlas.charts_of_instance[i]] = scene.instances[i].mesh;
  return mesh;
}

void pad(ByteWriter& w, size_t& written, size_t to) {
  for (; written < to; ++written) w.put<uint8_t>(0);
}

size_t aligned(size_t bytes) {
  return (bytes + kTableAlignment - 1) / kTableAlignment * kTableAlignment;
}

}  // namespace

std::string charts_json(const Scene& scene, const Atlas& atlas) {
  const PreviousLayout layout = previous_layout_of(scene, atlas);
  std::string out = text(
      "{{\n  \"format\": \"kiln charts\",\n  \"version\": 1,\n  \"width\": {},\n  \"height\": {},\n"
      "  \"pages\": {},\n  \"chart_sets\": [",
      atlas.width, atlas.height, atlas.pages);
  Lines sets(out);
  const std::vector<uint32_t> mesh = mesh_of_set(scene, atlas);
  for (size_t s = 0; s < atlas.charts.size(); ++s)
    sets.add(text(R"({{"mesh": {}, "charts": {}, "cut": {}}})", json_quote(scene.meshes[mesh[s]].name),
                  atlas.charts[s].chart_count, s >= scene.meshes.size() && atlas.charts[s].chart_count > 0));
  out += "\n  ],\n  \"instances\": [";
  Lines instances(out);
  for (size_t i = 0; i < scene.instances.size(); ++i)
    instances.add(instance_line(scene, atlas, i, layout.objects[i]));
  out += "\n  ],\n  \"transforms\": [";
  Lines transforms(out);
  for (const ChartTransform& t : chart_transforms(atlas))
    transforms.add(
        text("[{}, {}, {}, {}, {}, {}]", t.scale.x, t.scale.y, t.offset.x, t.offset.y, t.page, t.turned));
  out += "\n  ],\n  \"layout\": [";
  Lines places(out);
  for (const PackedChart& p : atlas.packed_charts)
    places.add(text(R"(["{:016x}", {}, {}, {}, {}])", p.key, p.x, p.y, p.page, p.turned));
  return out + "\n  ]\n}\n";
}

Bytes charts_binary(const Atlas& atlas) {
  const std::vector<ChartTransform> transforms = chart_transforms(atlas);
  const size_t first_at = kTableAlignment;
  const size_t table_at = aligned(first_at + atlas.instance_first_chart.size() * sizeof(uint32_t));
  ByteWriter w;
  for (const char c : std::string_view("KILNCHRT")) w.put(c);
  for (const size_t value : {size_t{1}, size_t{atlas.width}, size_t{atlas.height}, size_t{atlas.pages},
                             atlas.charts_of_instance.size(), transforms.size()})
    w.put(static_cast<uint32_t>(value));
  w.put<uint64_t>(first_at);
  w.put<uint64_t>(table_at);
  size_t written = 48;
  pad(w, written, first_at);
  for (const uint32_t first : atlas.instance_first_chart) w.put(first);
  written += atlas.instance_first_chart.size() * sizeof(uint32_t);
  pad(w, written, table_at);
  for (const ChartTransform& t : transforms) w.put(t);
  return w.take();
}

}  // namespace kiln
