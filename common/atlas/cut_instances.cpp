// Gives instances on which other surfaces stand their own charts, cut along the contacts.
#include "common/atlas/layout.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/contacts/contacts.h"

namespace kiln {

void warn_of_no_contacts(Atlas& atlas) {
  KILN_CHECK(atlas.contacts.empty());
  atlas.warnings.push_back(
      "hundreds of millions of pairs of triangles lie within each other's reach, or millions of surfaces "
      "stand on "
      "others, so charts were not cut there, and light can leak: where many copies fill one place and are "
      "not meant "
      "to, take them out of the model");
}

Status cut_at_contacts(const Scene& scene, std::span<const double> texel, const AtlasSettings& settings,
                       Atlas& atlas) {
  const ContactFinder finder(scene, texel, settings.threads);
  Contacts contacts = finder.find([&] { return !settings.check(); });
  KILN_TRY_STATUS(settings.check());
  atlas.contacts = std::move(contacts.lines);
  if (contacts.given_up) warn_of_no_contacts(atlas);
  const size_t count = scene.instances.size();
  std::vector<MeshCharts> cut(count);
  std::vector<size_t> refused(count);
  parallel_for(
      count,
      [&](size_t i) {
        const Instance& instance = scene.instances[i];
        if (!instance.receive || !settings.check()) return;
        cut[i] = cut_charts(
            scene.meshes[instance.mesh], instance.to_world, atlas.charts[instance.mesh],
            contacts.of_instance[i], texel[i],
            [&](uint32_t triangle, const DVec2& b) {
              return finder.is_buried(static_cast<uint32_t>(i), triangle, b);
            },
            refused[i]);
      },
      settings.threads);
  KILN_TRY_STATUS(settings.check());
  std::vector<std::string> names;
  for (size_t i = 0; i < count; ++i) {
    if (refused[i]) names.push_back(instance_name(scene, i));
    if (cut[i].face_count() == 0) continue;
    atlas.statistics.cut_charts += cut[i].chart_count - atlas.of_instance(i).chart_count;
    atlas.charts_of_instance[i] = static_cast<uint32_t>(atlas.charts.size());
    atlas.charts.push_back(std::move(cut[i]));
  }
  if (!names.empty())
    atlas.warnings.push_back(
        text("triangles with too many contacts were not cut, so light can leak under the objects there: {}; "
             "parting these in the model helps",
             list_names(names)));
  return {};
}

}  // namespace kiln
