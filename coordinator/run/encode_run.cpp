#include "coordinator/run/encode_run.h"

#include <algorithm>
#include <map>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/responses/basis.h"
#include "coordinator/bake/collapse/same_charts.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/context/context.h"
#include "coordinator/output/probes/published.h"
#include "coordinator/report/texture_report.h"
#include "coordinator/run/output_folder.h"
#include "coordinator/run/publish_folder.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxReportBytes = uint64_t{1} << 28;

tl::unexpected<Error> refuse(std::string why) {
  return fail(ErrorKind::kInvalidInput, std::move(why));
}

Expected<JsonValue> report_of(const fs::path& folder) {
  const fs::path path = folder / "report.json";
  const auto text_of = read_file(path, kMaxReportBytes);
  if (!text_of)
    return refuse(
        text("{}: this is not an output folder of a bake: {}", folder.string(), text_of.error().message));
  auto json = parse_json(std::string_view(reinterpret_cast<const char*>(text_of->data()), text_of->size()));
  if (!json) return refuse(text("{}: {}", path.string(), json.error().message));
  return std::move(*json);
}

// Settings that say what the numbers of a master mean: textures of another fit need another bake.
bool is_of_masters(const std::string& name) {
  return name == "sh-fit" || name == "sh-evaluator";
}

// Value of a row in the bake's report. Reports from before there were fits hold projections.
std::string value_in(const JsonValue& rows, const std::string& name) {
  const JsonValue* row = rows.find(name);
  const JsonValue* value = row ? row->find("value") : nullptr;
  if (value) return value->text;
  return name == "sh-fit" ? "project" : "linear";
}

// The bake's settings, overridden by those that the caller set.
Expected<BakeSettings> settings_of(const EncodeRequest& r, const JsonValue& json) {
  const JsonValue* rows = json.find("settings");
  if (!rows) return refuse(text("{}: its report has no settings", r.from.string()));
  BakeSettings out;
  for (const Setting& row : settings_table()) {
    const auto own = r.settings.source.find(row.name);
    if (is_of_masters(row.name)) {
      const std::string baked = value_in(*rows, row.name);
      if (own != r.settings.source.end() && row.print(r.settings) != baked)
        return refuse(
            text("{}: its masters were baked with --{} {}, and --{} {} would read them as what they are "
                 "not: leave the option out, or bake again",
                 r.from.string(), row.name, baked, row.name, row.print(r.settings)));
      KILN_TRY_STATUS(set_option(out, row.name, baked, "the bake"));
      continue;
    }
    if (own != r.settings.source.end()) {
      KILN_TRY_STATUS(set_option(out, row.name, row.print(r.settings), own->second));
      continue;
    }
    const JsonValue* stored = rows->find(row.name);
    const JsonValue* value = stored ? stored->find("value") : nullptr;
    const JsonValue* set_by = stored ? stored->find("set_by") : nullptr;
    // Some defaults print as text that does not parse (no sun: an empty string).
    if (!value || (set_by && set_by->text == "default")) continue;
    KILN_TRY_STATUS(set_option(out, row.name, value->text, "the bake"));
  }
  KILN_TRY_STATUS(check_settings(out));
  KILN_TRY_STATUS(check_encodings(out));
  return out;
}

// Bakes with --two-pass have a layout that depends on light: the report records it.
LayoutWish layout_of(const JsonValue& json) {
  const JsonValue* atlas = json.find("atlas");
  const JsonValue* two_pass = atlas ? atlas->find("two_pass") : nullptr;
  const JsonValue* collapsed = two_pass ? two_pass->find("collapsed") : nullptr;
  const JsonValue* density = atlas ? atlas->find("texels_per_metre") : nullptr;
  LayoutWish wish;
  if (!collapsed || !density) return wish;
  wish.texels_per_metre = static_cast<float>(density->number);
  std::map<CollapseReason, std::string> lists;
  for (const auto& [name, why] : {std::pair{"unseen", kUnseen}, {"black", kUnlit}, {"constant", kEvenlyLit}})
    if (const JsonValue* list = collapsed->find(name)) lists[why] = list->text;
  wish.collapse = [lists](const ChartsToSize& charts) {
    std::vector<uint8_t> out(charts.texels.size(), kNotCollapsed);
    // A master that cannot be read belongs to another scene: check_layout reports it.
    for (const auto& [why, list] : lists) static_cast<void>(read_charts(list, why, out));
    return out;
  };
  return wish;
}

// Blocks cannot hold what is no number, and a texture would show it as light or a hole.
Status check_finite(const fs::path& path, const std::string& channel, std::span<const float> values,
                    uint32_t width) {
  for (size_t t = 0; t < values.size(); ++t)
    if (!std::isfinite(values[t]))
      return refuse(
          text("{}: channel {} is {} at texel ({}, {}): the file was changed or damaged since the bake. "
               "Bake again, or put back the file that report.json has the SHA-256 of",
               path.string(), channel, values[t], t % width, t / width));
  return {};
}

// Textures are of what the bake stored.
Status check_fit(const fs::path& folder, const Atlas& atlas, const BakeSettings& settings) {
  const fs::path path = folder / page_name(settings.basis, "exr", 0, atlas.pages);
  KILN_TRY(const ExrNotes notes, read_exr_notes(path));
  const auto basis = notes.find("basis"), fit = notes.find("fit");
  if (basis != notes.end() && basis->second != settings.basis)
    return refuse(text("{}: it says that it holds the basis {}", path.string(), basis->second));
  // Bakes whose headers do not say so are projections.
  const std::string baked = fit == notes.end() ? "project" : fit->second;
  if (baked != fit_name(settings))
    return refuse(
        text("{}: its {} is a fit by '{}', and textures of '{}' are asked for: encode makes textures of "
             "what the bake stored. Leave the setting out, or bake again with it",
             path.string(), settings.basis, baked, fit_name(settings)));
  return {};
}

// Reads one master, pages stacked, into planes of the map; `names`: (channel of the file, plane).
Status read_master(const fs::path& folder, const std::string& stem, const Atlas& atlas,
                   const std::vector<std::pair<std::string, std::string>>& names, Planes& planes) {
  std::vector<std::vector<float>> all(names.size());
  for (uint32_t page = 0; page < atlas.pages; ++page) {
    const fs::path path = folder / page_name(stem, "exr", page, atlas.pages);
    KILN_TRY(const Planes file, read_exr(path));
    if (file.width != atlas.width || file.height != atlas.height)
      return refuse(
          text("{}: it has {}x{} texels and the scene's layout {}x{}: another scene or layout was baked",
               path.string(), file.width, file.height, atlas.width, atlas.height));
    for (size_t k = 0; k < names.size(); ++k) {
      if (std::find(file.names.begin(), file.names.end(), names[k].first) == file.names.end())
        return refuse(text("{}: it has no channel {}", path.string(), names[k].first));
      const std::vector<float>& channel = file.plane(names[k].first);
      KILN_TRY_STATUS(check_finite(path, names[k].first, channel, file.width));
      all[k].insert(all[k].end(), channel.begin(), channel.end());
    }
  }
  for (size_t k = 0; k < names.size(); ++k) planes.add(names[k].second) = std::move(all[k]);
  return {};
}

// An optional master.
Status read_if_there(const fs::path& folder, const std::string& stem, const Atlas& atlas,
                     const std::vector<std::string>& channels, Planes& planes) {
  std::error_code code;
  if (channels.empty() || !fs::exists(folder / page_name(stem, "exr", 0, atlas.pages), code)) return {};
  planes.width = atlas.width;
  planes.height = atlas.height * atlas.pages;
  std::vector<std::pair<std::string, std::string>> names;
  for (const std::string& channel : channels) names.emplace_back(channel, channel);
  return read_master(folder, stem, atlas, names, planes);
}

Status read_light(const fs::path& folder, const Atlas& atlas, const BakeSettings& settings, Lightmap& map) {
  KILN_TRY_STATUS(
      read_master(folder, "irradiance", atlas, {{"R", "E.R"}, {"G", "E.G"}, {"B", "E.B"}}, map.planes));
  const BasisInfo& basis = basis_of(settings);
  std::vector<std::pair<std::string, std::string>> names;
  for (const std::string_view function : basis.functions)
    for (const char* channel : {".R", ".G", ".B"})
      names.emplace_back(std::string(function) + channel, std::string(function) + channel);
  if (!names.empty()) {
    KILN_TRY_STATUS(check_fit(folder, atlas, settings));
    KILN_TRY_STATUS(read_master(folder, std::string(basis.name), atlas, names, map.planes));
  }
  map.bounds = direction_bounds(basis);
  KILN_TRY_STATUS(read_master(folder, "error", atlas, {{"Y", "error"}}, map.planes));
  std::vector<std::string> bands, measured;
  for (const BasisBand& band : basis_bands(basis)) bands.push_back(band.name);
  KILN_TRY_STATUS(read_if_there(folder, "error_" + settings.basis, atlas, bands, map.band_error));
  for (const std::string& plane : map.planes.names)
    if (plane != "samples") measured.push_back(plane);
  KILN_TRY_STATUS(read_if_there(folder, "measured", atlas, measured, map.measured));
  return {};
}

Status read_responses(const fs::path& folder, const Atlas& atlas, const Quantities& quantities,
                      Lightmap& map) {
  for (Planes* planes : {&map.responses, &map.response_error}) {
    planes->width = map.planes.width;
    planes->height = map.planes.height;
  }
  for (const uint32_t index : quantities.responses) {
    const ResponseInfo& r = response_roster()[index];
    const std::string name(r.name);
    std::vector<std::pair<std::string, std::string>> channels;
    for (size_t s = 0; s < r.stored.size(); ++s) channels.emplace_back(r.stored[s], response_plane(r, s));
    KILN_TRY_STATUS(read_master(folder, name, atlas, channels, map.responses));
    KILN_TRY_STATUS(read_master(folder, "error_" + name, atlas, {{"Y", name}}, map.response_error));
  }
  return {};
}

Expected<Lightmap> read_lightmap(const fs::path& folder, const Atlas& atlas, const BakeSettings& settings) {
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  KILN_TRY_STATUS(read_responses(folder, atlas, settings.quantities, map));
  map.has_light = settings.quantities.light;
  if (map.has_light) {
    KILN_TRY_STATUS(read_light(folder, atlas, settings, map));
  }
  KILN_TRY_STATUS(read_master(folder, "samples", atlas, {{"Y", "samples"}}, map.planes));
  Planes classes;
  classes.width = map.planes.width;
  classes.height = map.planes.height;
  KILN_TRY_STATUS(read_master(folder, "validity", atlas, {{"Y", "class"}}, classes));
  for (const float v : classes.data[0]) {
    if (!(v >= 0 && v < kValidityClasses) || v != std::floor(v))
      return refuse(text("{}: validity.exr has an unknown class {}", folder.string(), v));
    map.validity.push_back(static_cast<Validity>(v));
  }
  return map;
}

// Checks that the masters have the layout just built: every measured texel lies on a chart, and the
// chart table is equal.
Status check_layout(const EncodeRequest& r, const Preflight& pre, const Lightmap& map) {
  const auto other = [&](const char* what) {
    return refuse(
        text("{} and {} do not belong together: {}. Name the scene file that was baked, from the same folder",
             r.scene.string(), r.from.string(), what));
  };
  if (pre.atlas.packed) {
    const auto table = read_file(r.from / "charts.json", kMaxReportBytes);
    const std::string own = charts_json(pre.imported.scene, pre.atlas);
    if (!table || sha256(*table) != sha256(std::as_bytes(std::span(own))))
      return other("charts.json differs");
  }
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kMeasured && pre.atlas.owner[t] == 0)
      return other("a measured texel lies on no chart");
  return {};
}

// Textures that earlier runs added to the bake's folder: the next bake there removes them too.
std::set<std::string> files_of_earlier_encodes(const fs::path& folder, const std::set<std::string>& written) {
  const auto earlier = read_file(folder / "encode.json", kMaxReportBytes);
  if (!earlier) return {};
  std::set<std::string> names =
      listed_files({reinterpret_cast<const char*>(earlier->data()), earlier->size()});
  for (const std::string& name : written) names.erase(name);
  return names;
}

}  // namespace

Expected<EncodeReport> run_encode(const EncodeRequest& request,
                                  const std::function<void(const BakeProgress&)>& progress) {
  EncodeReport report;
  KILN_TRY(const JsonValue baked, report_of(request.from));
  KILN_TRY(report.settings, settings_of(request, baked));
  KILN_TRY_STATUS(check_output_folder(request.output));
  std::vector<StageTime> times;
  BakeSettings map_only = report.settings;
  map_only.probes = "off";
  map_only.probes_asked = false;
  KILN_TRY(const Preflight pre,
           run_preflight(request.scene, map_only, times, progress, {}, layout_of(baked)));
  progress({.stage = "masters"});
  KILN_TRY(const Lightmap map, read_lightmap(request.from, pre.atlas, report.settings));
  KILN_TRY_STATUS(check_layout(request, pre, map));
  KILN_TRY_STATUS(prepare_output_folder(request.output, pre.plan.output_bytes));
  KILN_TRY(PublishFolder folder, PublishFolder::open(request.output));
  progress({.stage = "textures"});
  const Stopwatch watch;
  KILN_TRY(const TextureResult textures,
           make_textures({pre.imported.scene, pre.atlas, map, report.settings, folder.path()}));
  report.seconds = watch.seconds();
  report.textures = textures.figures;
  report.unmet = beyond_bound(textures, report.settings);
  report.warnings = coarse_textures(textures);
  progress({.stage = "publish"});
  // Into the bake's own folder textures are added; its report stays that of the bake, and so do its probes.
  std::error_code code;
  const bool adds = fs::equivalent(request.from, request.output, code) && !code;
  std::optional<PublishedProbes> probes;
  if (adds && fs::exists(request.from / "probes.json", code)) {
    KILN_TRY(probes, read_published_probes(request.from));
  }
  KILN_TRY(report.files, write_outputs({report.settings, pre.imported.scene, pre.atlas, pre.imported.document,
                                        map, folder.path(), &pre.imported.display, &pre.projection,
                                        &textures.list, &textures.files, true, probes ? &*probes : nullptr}));
  KILN_TRY(report.written, folder.names());
  if (adds) report.added_before = files_of_earlier_encodes(request.output, report.written);
  KILN_TRY_STATUS(write_file_atomic(folder.path() / "encode.json", encode_json(report)));
  KILN_TRY_STATUS(folder.publish("encode.json", adds ? Earlier::kKeep : Earlier::kRemove));
  return report;
}

std::string encode_json(const EncodeReport& r) {
  JsonWriter w;
  w.begin_object().pair("seconds", r.seconds);
  if (!r.unmet.empty()) w.pair("unmet", r.unmet);
  w.key("warnings").begin_array();
  for (const std::string& warning : r.warnings) w.value(warning);
  w.end_array();
  write_textures(w, r.textures);
  w.key("outputs").begin_array();
  for (const OutputFile& f : r.files)
    w.begin_object().pair("file", f.name).pair("bytes", f.bytes).pair("sha256", f.digest.hex()).end_object();
  w.end_array();
  for (const auto& [key, names] :
       {std::pair("files", &r.written), std::pair("added_before", &r.added_before)}) {
    w.key(key).begin_array();
    for (const std::string& name : *names) w.value(name);
    w.end_array();
  }
  return w.end_object().take();
}

}  // namespace kiln
