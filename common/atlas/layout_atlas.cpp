#include <set>

#include "common/atlas/layout.h"
#include "common/atlas/sites.h"
#include "common/base/figures.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/contacts/contacts.h"
#include "common/raster/footprint.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

// Coordinates may leave [0, 1] by this: exporters write 1.0000001.
constexpr float kOutside = 1e-4f;
// Overlap is an error when a quarter of one texel is claimed twice, or a thousandth of all texels by more
// than bare contact. Adjoining charts that share a border up to rounding stay below that.
constexpr uint32_t kMaxPoints = 16;
constexpr double kMaxTexels = 0.001;

// Instances that get texels and whose mesh `is_bad`, by name.
template <class IsBad>
std::vector<std::string> instances_where(const Scene& scene, const IsBad& is_bad) {
  std::vector<std::string> names;
  for (size_t i = 0; i < scene.instances.size(); ++i)
    if (scene.instances[i].receive && is_bad(scene.instances[i].mesh))
      names.push_back(instance_name(scene, i));
  return names;
}

bool leaves_unit_square(const MeshCharts& charts) {
  for (const Vec2& uv : charts.corner_uv)
    if (std::min(uv.x, uv.y) < -kOutside || std::max(uv.x, uv.y) > 1 + kOutside) return true;
  return false;
}

// Whether the mesh has a TEXCOORD_1 in which no triangle has area.
bool without_area(const Mesh& mesh) {
  if (mesh.uv[1].empty() || mesh.triangles.empty()) return false;
  for (const UVec3& t : mesh.triangles) {
    const Triangle2 uv{{DVec2(mesh.uv[1][t.x]), DVec2(mesh.uv[1][t.y]), DVec2(mesh.uv[1][t.z])}};
    if (area2(uv) != 0) return false;
  }
  return true;
}

void tell_of_areas(const Scene& scene, const std::vector<uint8_t>& wanted, Atlas& atlas) {
  constexpr double kWorthSaying = 0.01;
  const std::vector<std::string> flat = instances_where(
      scene, [&](uint32_t m) { return degenerate_share(scene.meshes[m], atlas.charts[m]) > kWorthSaying; });
  if (!flat.empty())
    atlas.warnings.push_back(text(
        "more than {:g} % of the surface has no area in TEXCOORD_1 and gets no light of its own: {}; give "
        "it an area, or --layout pack",
        100 * kWorthSaying, list_names(flat)));
  const std::vector<std::string> none =
      instances_where(scene, [&](uint32_t m) { return wanted[m] && atlas.charts[m].chart_count == 0; });
  if (!none.empty())
    atlas.warnings.push_back(text(
        "these have no area in TEXCOORD_1, so they get no texels: {}; extras.kiln.receive false says so on "
        "purpose, --layout pack gives them charts",
        list_names(none)));
}

Status read_charts(const Scene& scene, Atlas& atlas, unsigned threads) {
  const size_t count = scene.meshes.size();
  const std::vector<uint8_t> wanted = meshes_with_texels(scene);
  std::vector<std::string> why(count);
  atlas.charts.resize(count);
  parallel_for(
      count,
      [&](size_t m) {
        if (!wanted[m] || without_area(scene.meshes[m])) return;
        if (auto charts = authored_charts(scene.meshes[m]))
          atlas.charts[m] = std::move(*charts);
        else
          why[m] = charts.error().message;
      },
      threads);
  // One sentence for the first kind of problem found, naming every instance that shares it.
  for (const Instance& instance : scene.instances)
    if (const std::string& trouble = why[instance.mesh]; !trouble.empty())
      return fail(
          ErrorKind::kInvalidInput,
          text("layout atlas needs a usable lightmap coordinate set on every object; one that {}: {}",
               trouble, list_names(instances_where(scene, [&](uint32_t m) { return why[m] == trouble; }))));
  tell_of_areas(scene, wanted, atlas);
  std::vector<char> outside(count);
  for (size_t m = 0; m < count; ++m) outside[m] = leaves_unit_square(atlas.charts[m]);
  const std::vector<std::string> names = instances_where(scene, [&](uint32_t m) { return outside[m]; });
  if (!names.empty())
    return fail(
        ErrorKind::kInvalidInput,
        text("layout atlas needs TEXCOORD_1 within [0, 1], which it leaves on {}", list_names(names)));
  return {};
}

std::string overlap_sentence(const Scene& scene, const Atlas& atlas, const SiteOverlap& overlap) {
  const std::string a = instance_name(scene, overlap.instance[0]),
                    b = instance_name(scene, overlap.instance[1]);
  const std::string who = overlap.instance[0] == overlap.instance[1]
                              ? text("{} covers itself", a)
                              : text("{} and {} lie on each other", a, b);
  return text(
      "{} in the lightmap, at worst at texel ({}, {}): {} of its 64 points; {:.1f} % of the covered area "
      "is claimed twice",
      who, overlap.worst_texel % atlas.width, overlap.worst_texel / atlas.width, overlap.worst_points,
      100.0 * static_cast<double>(overlap.points) / static_cast<double>(overlap.covered_points));
}

Status judge_overlap(const Scene& scene, const SiteOverlap& overlap, Atlas& atlas) {
  if (overlap.points == 0) return {};
  std::string sentence = overlap_sentence(scene, atlas, overlap);
  const double most = kMaxTexels * static_cast<double>(atlas.sites.size());
  if (overlap.worst_points >= kMaxPoints || static_cast<double>(overlap.texels) > most)
    return fail(ErrorKind::kInvalidInput,
                text("layout atlas needs every point to belong to one object: {}", sentence));
  atlas.warnings.push_back(sentence + "; the first object has those points: part them, or --layout pack");
  return {};
}

// In order of placements; the first one wins.
void own_footprints(const Scene& scene, Atlas& atlas) {
  atlas.owner.assign(atlas.texel_count(), 0);
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    for (size_t t = 0; t < charts.chart_of_face.size(); ++t) {
      const uint32_t placement = atlas.instance_first_chart[i] + charts.chart_of_face[t];
      const Triangle2 triangle = texel_triangle(charts, atlas.placements[placement], t);
      for_each_footprint_span(triangle, atlas.width, atlas.height, [&](uint32_t y, uint32_t x0, uint32_t x1) {
        for (uint32_t x = x0; x <= x1; ++x)
          if (uint32_t& owner = atlas.owner[size_t{y} * atlas.width + x]; owner == 0) owner = placement + 1;
      });
    }
  }
}

// A texel with sites goes to the chart that has most of them (the first of several).
void own_by_sites(Atlas& atlas) {
  const TexelSites& s = atlas.sites;
  std::vector<std::pair<uint32_t, uint32_t>> points;  // placement, count
  for (size_t i = 0; i < s.size(); ++i) {
    points.clear();
    for (uint32_t w = s.first_word[i] + 2; w < s.first_word[i + 1]; w += 4) {
      const uint32_t* pair = &s.words[w];
      const uint32_t chart = atlas.of_instance(pair[2]).chart_of_face[pair[3]];
      const uint32_t placement = atlas.instance_first_chart[pair[2]] + chart;
      const auto n = static_cast<uint32_t>(std::popcount(pair[0]) + std::popcount(pair[1]));
      const auto known =
          std::find_if(points.begin(), points.end(), [&](const auto& p) { return p.first == placement; });
      if (known != points.end())
        known->second += n;
      else
        points.push_back({placement, n});
    }
    const auto best = std::min_element(points.begin(), points.end(), [](const auto& p, const auto& q) {
      return p.second != q.second ? p.second > q.second : p.first < q.first;
    });
    atlas.owner[s.texel[i]] = best->first + 1;
  }
}

// Metres that a texel of each instance spans: the root of its surface over its texels; 1 without any.
std::vector<double> texel_sizes(const Scene& scene, const Atlas& atlas) {
  std::vector<double> sizes(scene.instances.size(), 1.0);
  for (size_t i = 0; i < sizes.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const MeshCharts& charts = atlas.of_instance(i);
    const Mesh& mesh = scene.meshes[instance.mesh];
    double surface = 0, texels = 0;
    for (size_t t = 0; t < charts.chart_of_face.size(); ++t) {
      const uint32_t placement = atlas.instance_first_chart[i] + charts.chart_of_face[t];
      texels += std::abs(area2(texel_triangle(charts, atlas.placements[placement], t)));
      Vec3 p[3];
      for (int k = 0; k < 3; ++k)
        p[k] = transform_point(instance.to_world, mesh.positions[mesh.triangles[charts.triangle_of(t)][k]]);
      surface += double{length(cross(p[1] - p[0], p[2] - p[0]))};
    }
    if (surface > 0 && texels > 0) sizes[i] = std::sqrt(surface / texels);
  }
  return sizes;
}

// Charts of the file are not cut, but where surfaces stand on them light must not be taken across.
Status note_contacts(const Scene& scene, const AtlasSettings& settings, Atlas& atlas) {
  const std::vector<double> texel = texel_sizes(scene, atlas);
  const ContactFinder finder(scene, texel, settings.threads);
  Contacts contacts = finder.find([&] { return !settings.check(); });
  atlas.contacts = std::move(contacts.lines);
  if (contacts.given_up) warn_of_no_contacts(atlas);
  return settings.check();
}

}  // namespace

Expected<Atlas> layout_from_file(const Scene& scene, const AtlasSettings& settings) {
  Atlas atlas;
  atlas.width = settings.width;
  atlas.height = settings.height;
  KILN_TRY_STATUS(read_charts(scene, atlas, settings.threads));
  std::vector<uint8_t> receives;
  for (const Instance& instance : scene.instances) {
    atlas.charts_of_instance.push_back(instance.mesh);
    receives.push_back(instance.receive && atlas.charts[instance.mesh].chart_count > 0);
  }
  take_charts_away(scene, receives, atlas);
  KILN_TRY_STATUS(number_placements(scene, atlas));
  for (ChartPlacement& place : atlas.placements)
    place.scale = Vec2(static_cast<float>(atlas.width), static_cast<float>(atlas.height));
  KILN_TRY(const SiteOverlap overlap, find_sites(atlas, settings.threads));
  KILN_TRY_STATUS(judge_overlap(scene, overlap, atlas));
  own_footprints(scene, atlas);
  own_by_sites(atlas);
  for (uint32_t owner : atlas.owner) atlas.statistics.mask_texels += owner != 0;
  atlas.statistics.overlapped_points = overlap.points;
  if (settings.cut_contacts) {
    const StageTimer timer(atlas.statistics.steps, "contacts");
    KILN_TRY_STATUS(note_contacts(scene, settings, atlas));
  }
  return atlas;
}

}  // namespace kiln
