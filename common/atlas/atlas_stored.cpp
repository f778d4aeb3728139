#include "common/atlas/atlas.h"
#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint32_t kAtlasMagic = 0x41544c31;

uint64_t mask64(uint32_t lo, uint32_t hi) {
  return lo | uint64_t{hi} << 32;
}

// Checks one record; true if every pair is in range and every valid point is covered exactly once.
bool check_record(std::span<const uint32_t> record, const Scene& scene) {
  if (record.size() < 6 || (record.size() - 2) % 4 != 0) return false;
  const uint64_t valid = mask64(record[0], record[1]);
  uint64_t seen = 0;
  for (size_t w = 2; w < record.size(); w += 4) {
    const uint64_t cover = mask64(record[w], record[w + 1]);
    if (cover & seen) return false;
    seen |= cover;
    if (record[w + 2] >= scene.instances.size()) return false;
    if (record[w + 3] >= scene.meshes[scene.instances[record[w + 2]].mesh].triangles.size()) return false;
  }
  return valid != 0 && seen == valid;
}

bool finite(const Vec2& v) {
  return std::isfinite(v.x) && std::isfinite(v.y);
}

}  // namespace

Bytes write_atlas(const Atlas& atlas) {
  ByteWriter w;
  w.put(kAtlasMagic);
  w.put(atlas.width);
  w.put(atlas.height);
  w.put(atlas.pages);
  w.put<uint64_t>(atlas.meshes.size());
  for (const MeshCharts& m : atlas.meshes) {
    w.put_array(m.corner_uv);
    w.put_array(m.chart_of_triangle);
    w.put(m.chart_count);
  }
  w.put_array(atlas.instance_first_chart);
  w.put_array(atlas.placements);
  w.put_array(atlas.sites.texel);
  w.put_array(atlas.sites.first_word);
  w.put_array(atlas.sites.words);
  return w.take();
}

Expected<Atlas> read_atlas(std::span<const std::byte> bytes, const Scene& scene) {
  const auto bad = [](std::string_view what) {
    return fail(ErrorKind::kInvalidInput, text("an atlas chunk is damaged: {}", what));
  };
  ByteReader r(bytes);
  Atlas a;
  if (r.get<uint32_t>() != kAtlasMagic) return bad("it is not an atlas");
  a.width = r.get<uint32_t>();
  a.height = r.get<uint32_t>();
  a.pages = r.get<uint32_t>();
  a.meshes.resize(r.get_count(20));
  for (MeshCharts& m : a.meshes) {
    m.corner_uv = r.get_array<Vec2>();
    m.chart_of_triangle = r.get_array<uint32_t>();
    m.chart_count = r.get<uint32_t>();
    if (!r.ok()) break;
  }
  a.instance_first_chart = r.get_array<uint32_t>();
  a.placements = r.get_array<ChartPlacement>();
  a.sites.texel = r.get_array<uint32_t>();
  a.sites.first_word = r.get_array<uint32_t>();
  a.sites.words = r.get_array<uint32_t>();
  if (!r.at_end()) return bad("its length is wrong");

  if (a.width == 0 || a.height == 0 || a.pages == 0 || a.width > 1u << 16 || a.height > 1u << 16 ||
      a.pages > 1u << 16 || a.texel_count() > uint64_t{1} << 31)
    return bad("its size is wrong");
  if (a.meshes.size() != scene.meshes.size()) return bad("it belongs to another scene");
  for (size_t m = 0; m < a.meshes.size(); ++m) {
    const size_t triangles = scene.meshes[m].triangles.size();
    if (a.meshes[m].corner_uv.size() != 3 * triangles || a.meshes[m].chart_of_triangle.size() != triangles)
      return bad("a mesh has other triangles");
    for (const Vec2& uv : a.meshes[m].corner_uv)
      if (!finite(uv)) return bad("a coordinate is not a number");
    for (uint32_t chart : a.meshes[m].chart_of_triangle)
      if (chart >= a.meshes[m].chart_count) return bad("a chart does not exist");
  }
  if (a.instance_first_chart.size() != scene.instances.size() + 1) return bad("an instance has no charts");
  for (size_t i = 0; i < scene.instances.size(); ++i)
    if (uint64_t{a.instance_first_chart[i]} + a.meshes[scene.instances[i].mesh].chart_count >
        a.placements.size())
      return bad("a placement does not exist");
  for (const ChartPlacement& place : a.placements)
    if (!finite(place.scale) || !finite(place.offset) || place.page >= a.pages)
      return bad("a chart is placed outside it");
  const TexelSites& s = a.sites;
  if (s.first_word.size() != s.texel.size() + 1) return bad("its sites are inconsistent");
  for (size_t i = 0; i < s.texel.size(); ++i) {
    if (s.texel[i] >= a.texel_count() || s.first_word[i] > s.first_word[i + 1] ||
        s.first_word[i + 1] > s.words.size())
      return bad("a site is out of range");
    const std::span<const uint32_t> record(s.words.data() + s.first_word[i],
                                           s.first_word[i + 1] - s.first_word[i]);
    if (!check_record(record, scene)) return bad("a site names surface that does not exist");
  }
  return a;
}

}  // namespace kiln
