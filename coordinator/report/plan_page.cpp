#include "coordinator/report/plan_page.h"

#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/report/html.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

std::string minutes(double seconds) {
  return seconds < 90 ? text("{:.0f} s", seconds) : text("{:.0f} min", seconds / 60);
}

// The row of probes.
std::string probes_text(const ProbePlan& p) {
  return text("{} in {} volume{}, {} of them inside geometry, {:g} to {:g} m apart{}", p.probes, p.volumes,
              p.volumes == 1 ? "" : "s", p.inactive, p.spacing, p.max_spacing,
              p.visibility ? ", with visibility" : "");
}

bool has_map(const PlanView& v) {
  return v.atlas.texel_count() > 0;
}

std::string facts(const PlanView& v) {
  std::string out = "<table>\n";
  const auto row = [&](std::string_view name, const std::string& value) {
    out += text("<tr><td>{}</td><td>{}</td></tr>\n", name, escape(value));
  };
  const Plan& p = v.plan;
  if (p.probes.volumes > 0) row("probes", probes_text(p.probes));
  if (!has_map(v)) return out + "</table>\n";
  row("layout", text("{}, {} x {}, {} page{}", v.atlas.packed ? "pack" : "atlas", v.atlas.width,
                     v.atlas.height, v.atlas.pages, v.atlas.pages == 1 ? "" : "s"));
  if (v.atlas.packed) row("texels per metre", text("{:.4g}", v.atlas.statistics.texels_per_metre));
  row("texels",
      text("{}, {} to sample, {:.1f} % empty", p.texels, p.valid_texels, 100 * (1 - v.atlas.used_share())));
  row("charts", text("{}", p.charts));
  row("triangles", text("{} ({} stored)", p.triangles, p.stored_triangles));
  row("memory", text("coordinator {} MiB, each worker {} MiB (estimates)", (p.coordinator_bytes >> 20) + 1,
                     (p.worker_bytes >> 20) + 1));
  row("files", text("{} MiB before compression (estimate)", (p.output_bytes >> 20) + 1));
  row("time", text("{} at {} samples to {} at {} samples everywhere (estimates)", minutes(p.least_seconds),
                   p.least_samples, minutes(p.most_seconds), p.most_samples));
  return out + "</table>\n";
}

std::string findings(const PlanView& v) {
  std::string out = "<ul>\n";
  const auto item = [&](std::string_view kind, const std::string& what) {
    out += text("<li><b>{}</b> {}</li>\n", kind, escape(what));
  };
  for (const std::string& s : v.plan.warnings) item("warning", s);
  for (const std::string& s : v.atlas.warnings) item("warning", s);
  for (const ImportNote& n : v.imported.notes) item(note_kind(n.kind), n.what);
  for (const std::string& s : v.plan.left_out) item("left out", s);
  return out + "</ul>\n";
}

}  // namespace

std::string_view note_kind(ImportNote::Kind kind) {
  switch (kind) {
    case ImportNote::Kind::kBaked:
      return "baked";
    case ImportNote::Kind::kApproximated:
      return "approximated";
    case ImportNote::Kind::kIgnored:
      return "ignored";
    case ImportNote::Kind::kWarning:
      return "warning";
    case ImportNote::Kind::kNote:
      return "note";
  }
  return "";
}

void write_objects(JsonWriter& w, const std::vector<ObjectPlan>& objects) {
  uint64_t all = 0;
  for (const ObjectPlan& o : objects) all += o.texels;
  w.key("objects").begin_array();
  for (const ObjectPlan& o : objects) {
    w.begin_object()
        .pair("name", o.name)
        .pair("mesh", o.mesh)
        .pair("material", o.material)
        .pair("charts", o.charts);
    w.pair("texels", o.texels).pair("valid_texels", o.valid_texels);
    w.pair("share", static_cast<double>(o.texels) / static_cast<double>(std::max<uint64_t>(1, all)));
    w.pair("texels_per_metre", o.texels_per_metre).pair("square_metres", o.square_metres);
    w.pair("density_factor", o.factor);
    w.pair("receive", o.receive).pair("cast", o.cast).pair("reflect", o.reflect).end_object();
  }
  w.end_array();
}

JsonWriter& write_unseen(JsonWriter& w, const AtlasStatistics& a) {
  const CollapsedCharts& unseen = a.collapsed[kUnseen];
  w.key("unseen").begin_object().pair("charts", unseen.charts);
  return w.pair("texels", unseen.from)
      .pair("share", a.share(unseen.from))
      .pair("saved_texels", unseen.saved());
}

std::string plan_json(const PlanView& v) {
  JsonWriter w;
  const Plan& p = v.plan;
  w.begin_object().pair("layout", v.atlas.packed ? "pack" : "atlas");
  w.pair("width", v.atlas.width).pair("height", v.atlas.height).pair("pages", v.atlas.pages);
  w.pair("texels", p.texels).pair("valid_texels", p.valid_texels).pair("charts", p.charts);
  w.pair("kept_charts", v.atlas.statistics.kept_charts);
  w.pair("chart_texels", v.atlas.statistics.mask_texels).pair("used_share", v.atlas.used_share());
  if (v.atlas.packed) w.pair("texels_per_metre", double{v.atlas.statistics.texels_per_metre});
  write_unseen(w, v.atlas.statistics).end_object();
  w.pair("triangles", p.triangles).pair("stored_triangles", p.stored_triangles);
  w.pair("coordinator_bytes", p.coordinator_bytes).pair("worker_bytes", p.worker_bytes);
  w.pair("output_bytes", p.output_bytes);
  w.pair("least_seconds", p.least_seconds).pair("most_seconds", p.most_seconds);
  w.pair("least_samples", p.least_samples).pair("most_samples", p.most_samples);
  if (p.probes.volumes > 0) {
    const ProbePlan& probes = p.probes;
    w.key("probes").begin_object().pair("volumes", probes.volumes).pair("probes", probes.probes);
    w.pair("inactive", probes.inactive).pair("spacing", probes.spacing);
    w.pair("max_spacing", probes.max_spacing).pair("visibility", probes.visibility);
    w.pair("coordinator_bytes", probes.coordinator_bytes).pair("output_bytes", probes.output_bytes);
    w.pair("least_seconds", probes.least_seconds).pair("most_seconds", probes.most_seconds).end_object();
  }
  write_objects(w, p.objects);
  w.key("lods").begin_array();
  for (const DisplayFit& f : v.projection.fits)
    w.begin_object()
        .pair("name", f.name)
        .pair("level", f.level)
        .pair("baked", f.baked)
        .pair("worst_metres", f.worst)
        .pair("mean_metres", f.mean)
        .pair("limit_metres", f.limit)
        .pair("lookup_shift_texels", f.shift_texels)
        .pair("triangles", f.triangles)
        .pair("faces", f.faces)
        .end_object();
  w.end_array();
  w.key("left_out").begin_array();
  for (const std::string& s : p.left_out) w.value(s);
  w.end_array().key("notes").begin_array();
  const auto note = [&](std::string_view kind, const std::string& what) {
    w.begin_object().pair("kind", kind).pair("what", what).end_object();
  };
  for (const ImportNote& n : v.imported.notes) note(note_kind(n.kind), n.what);
  for (const std::string& s : v.atlas.warnings) note("warning", s);
  for (const std::string& s : p.warnings) note("warning", s);
  return w.end_array().end_object().take();
}

Expected<std::string> plan_html(const PlanView& v, const std::filesystem::path& scene,
                                const PlanPictures& pictures) {
  std::string out = page_head("plan of " + scene.filename().string());
  const auto show = [&](const Picture& p, const char* caption) -> Status {
    if (!p.width) return {};
    KILN_TRY(const Bytes png, encode_png(p.width, p.height, p.rgb));
    out += embedded(png, caption);
    return {};
  };
  KILN_TRY_STATUS(show(pictures.heat_map, "texels per metre; squares are texels"));
  KILN_TRY_STATUS(
      show(pictures.probes, "probes and their bricks; dots that lie behind each other are mixed"));
  if (has_map(v)) out += "<h2>Objects</h2>\n" + objects_table_html(v.plan.objects);
  out += "<h2>Facts</h2>\n" + facts(v);
  return out + "<h2>Findings</h2>\n" + findings(v) + "</html>\n";
}

}  // namespace kiln
