#include "common/atlas/layout.h"
#include "common/atlas/sites.h"
#include "common/base/format.h"

namespace kiln {
namespace {

Status check_settings(const AtlasSettings& s) {
  const auto refuse = [](std::string message) { return fail(ErrorKind::kUsage, std::move(message)); };
  if (s.width < 1 || s.height < 1 || uint64_t{s.width} * s.height > uint64_t{1} << 31 ||
      std::max(s.width, s.height) > 1u << 16)
    return refuse(text("a lightmap of {} x {} texels cannot be made: 1 to 65536 a side, 2^31 in all", s.width,
                       s.height));
  if (s.layout == AtlasSettings::Layout::kAtlas && uint64_t{s.width} * s.height > s.max_texels)
    return refuse(text("a lightmap of {} x {} texels is more than the {:.3g} million that fit (--resolution)",
                       s.width, s.height, static_cast<double>(s.max_texels) / 1e6));
  if (!(s.texels_per_metre > 0 && std::isfinite(s.texels_per_metre)))
    return refuse(text("{} texels per metre is not a valid density", s.texels_per_metre));
  if (s.max_page_size < 4 || s.max_page_size > 1u << 14)
    return refuse(text("a page of {} texels a side cannot be made: 4 to 16384", s.max_page_size));
  if (s.mip_levels > 8 || s.max_page_size < 4u << s.mip_levels)
    return refuse(
        text("{} mip levels need pages of {} texels a side or more, and 8 is the most (--mip-levels)",
             s.mip_levels, uint64_t{4} << std::min(s.mip_levels, 8u)));
  return {};
}

Expected<Atlas> finish(const Scene& scene, const AtlasSettings& settings, Atlas atlas) {
  if (atlas.sites.size() == 0)
    return fail(ErrorKind::kInvalidInput,
                text("no texel is covered: {} instances with {} triangles have no area in the lightmap",
                     scene.instances.size(), scene.triangle_count()));
  order_sites(scene, atlas, settings.threads);
  atlas.statistics.charts = atlas.placements.size();
  atlas.statistics.covered_texels = atlas.sites.size();
  return atlas;
}

}  // namespace

std::string instance_name(const Scene& scene, size_t instance) {
  const std::string& name = scene.instances[instance].name;
  return name.empty() ? text("instance {}", instance) : text("'{}'", name);
}

std::string mesh_name(const Scene& scene, size_t mesh) {
  const std::string& name = scene.meshes[mesh].name;
  return name.empty() ? text("number {}", mesh) : text("'{}'", name);
}

std::string list_names(const std::vector<std::string>& names) {
  constexpr size_t kShown = 5;
  std::string list;
  for (size_t i = 0; i < std::min(names.size(), kShown); ++i) list += (i ? ", " : "") + names[i];
  if (names.size() > kShown) list += text(" and {} more", names.size() - kShown);
  return list;
}

void take_charts_away(const Scene& scene, std::span<const uint8_t> receives, Atlas& atlas) {
  constexpr uint32_t kNone = ~0u;
  uint32_t empty = kNone;
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    if (receives[i]) continue;
    if (empty == kNone) {
      empty = static_cast<uint32_t>(atlas.charts.size());
      atlas.charts.emplace_back();
    }
    atlas.charts_of_instance[i] = empty;
  }
}

std::vector<uint8_t> meshes_with_texels(const Scene& scene) {
  std::vector<uint8_t> with(scene.meshes.size(), 0);
  for (const Instance& i : scene.instances)
    if (i.receive) with[i.mesh] = 1;
  return with;
}

Status number_placements(const Scene& scene, Atlas& atlas) {
  uint64_t count = 0;
  atlas.instance_first_chart.clear();
  for (const Instance& instance : scene.instances) {
    atlas.instance_first_chart.push_back(static_cast<uint32_t>(count));
    count += atlas.of_instance(&instance - scene.instances.data()).chart_count;
    if (count >= uint64_t{1} << 31)
      return fail(ErrorKind::kInvalidInput, "the scene has more than 2^31 charts");
  }
  atlas.instance_first_chart.push_back(static_cast<uint32_t>(count));
  atlas.placements.assign(count, {});
  return {};
}

Expected<Atlas> build_atlas(const Scene& scene, const AtlasSettings& settings) {
  using Layout = AtlasSettings::Layout;
  KILN_TRY_STATUS(check_settings(settings));
  std::string why_packed;
  if (settings.layout != Layout::kPack) {
    Expected<Atlas> atlas = layout_from_file(scene, settings);
    if (atlas) atlas = finish(scene, settings, std::move(*atlas));
    if (atlas || settings.layout == Layout::kAtlas) return atlas;
    why_packed = atlas.error().message;
  }
  KILN_TRY(Atlas packed, layout_packed(scene, settings));
  if (!why_packed.empty())
    packed.notes.insert(packed.notes.begin(), text("layout pack was chosen: {}", why_packed));
  return finish(scene, settings, std::move(packed));
}

}  // namespace kiln
