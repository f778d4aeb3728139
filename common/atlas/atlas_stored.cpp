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
bool check_record(std::span<const uint32_t> record, const Atlas& atlas) {
  if (record.size() < 6 || (record.size() - 2) % 4 != 0) return false;
  const uint64_t valid = mask64(record[0], record[1]);
  uint64_t seen = 0;
  for (size_t w = 2; w < record.size(); w += 4) {
    const uint64_t cover = mask64(record[w], record[w + 1]);
    if (cover & seen) return false;
    seen |= cover;
    if (record[w + 2] >= atlas.charts_of_instance.size()) return false;
    if (record[w + 3] >= atlas.of_instance(record[w + 2]).face_count()) return false;
  }
  return valid != 0 && seen == valid;
}

bool finite(const Vec2& v) {
  return std::isfinite(v.x) && std::isfinite(v.y);
}

// Checks that every face has coordinates and a chart, and that every part lies in its triangle. Returns what
// is wrong, or "".
std::string_view fault_of_charts(const MeshCharts& m) {
  const size_t faces = m.face_count();
  if (m.corner_uv.size() != 3 * faces || (!m.parts.empty() && m.parts.size() != faces))
    return "a mesh has other faces";
  for (const Vec2& uv : m.corner_uv)
    if (!finite(uv)) return "a coordinate is not a number";
  for (uint32_t chart : m.chart_of_face)
    if (chart >= m.chart_count) return "a chart does not exist";
  for (const FacePart& part : m.parts)
    for (const Vec2& b : part.corner)
      if (!(b.x >= 0 && b.y >= 0 && b.x + b.y <= 1.0f + 1e-6f)) return "a part lies outside its triangle";
  return {};
}

// Whether the faces of these charts exist in the mesh.
bool faces_exist(const MeshCharts& m, const Mesh& mesh) {
  if (m.face_count() == 0 && m.chart_count == 0) return true;  // it gets no texels
  if (m.parts.empty()) return m.face_count() == mesh.triangles.size();
  for (const FacePart& part : m.parts)
    if (part.triangle >= mesh.triangles.size()) return false;
  return true;
}

}  // namespace

Bytes write_atlas(const Atlas& atlas) {
  ByteWriter w;
  w.put(kAtlasMagic);
  w.put(atlas.width);
  w.put(atlas.height);
  w.put(atlas.pages);
  w.put<uint64_t>(atlas.charts.size());
  for (const MeshCharts& m : atlas.charts) {
    w.put_array(m.corner_uv);
    w.put_array(m.chart_of_face);
    w.put_array(m.parts);
    w.put(m.chart_count);
  }
  w.put_array(atlas.charts_of_instance);
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
  a.charts.resize(r.get_count(28));
  for (MeshCharts& m : a.charts) {
    m.corner_uv = r.get_array<Vec2>();
    m.chart_of_face = r.get_array<uint32_t>();
    m.parts = r.get_array<FacePart>();
    m.chart_count = r.get<uint32_t>();
    if (!r.ok()) break;
  }
  a.charts_of_instance = r.get_array<uint32_t>();
  a.instance_first_chart = r.get_array<uint32_t>();
  a.placements = r.get_array<ChartPlacement>();
  a.sites.texel = r.get_array<uint32_t>();
  a.sites.first_word = r.get_array<uint32_t>();
  a.sites.words = r.get_array<uint32_t>();
  if (!r.at_end()) return bad("its length is wrong");

  if (a.width == 0 || a.height == 0 || a.pages == 0 || a.width > 1u << 16 || a.height > 1u << 16 ||
      a.pages > 1u << 16 || a.texel_count() > uint64_t{1} << 31)
    return bad("its size is wrong");
  for (const MeshCharts& m : a.charts)
    if (const std::string_view fault = fault_of_charts(m); !fault.empty()) return bad(fault);
  if (a.charts_of_instance.size() != scene.instances.size()) return bad("it belongs to another scene");
  for (size_t i = 0; i < scene.instances.size(); ++i)
    if (a.charts_of_instance[i] >= a.charts.size() ||
        !faces_exist(a.of_instance(i), scene.meshes[scene.instances[i].mesh]))
      return bad("a mesh has other faces");
  if (a.instance_first_chart.size() != scene.instances.size() + 1) return bad("an instance has no charts");
  for (size_t i = 0; i < scene.instances.size(); ++i)
    if (uint64_t{a.instance_first_chart[i]} + a.of_instance(i).chart_count > a.placements.size())
      return bad("a placement does not exist");
  for (const ChartPlacement& place : a.placements)
    if (!finite(place.scale) || !finite(place.offset) || place.page >= a.pages || place.turned > 1)
      return bad("a chart is placed outside it");
  const TexelSites& s = a.sites;
  if (s.first_word.size() != s.texel.size() + 1) return bad("its sites are inconsistent");
  for (size_t i = 0; i < s.texel.size(); ++i) {
    if (s.texel[i] >= a.texel_count() || s.first_word[i] > s.first_word[i + 1] ||
        s.first_word[i + 1] > s.words.size())
      return bad("a site is out of range");
    const std::span<const uint32_t> record(s.words.data() + s.first_word[i],
                                           s.first_word[i + 1] - s.first_word[i]);
    if (!check_record(record, a)) return bad("a site names surface that does not exist");
  }
  return a;
}

}  // namespace kiln
