#include <cmath>

#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/report/plan_page.h"
#include "coordinator/report/report.h"
#include "coordinator/report/texture_report.h"

namespace kiln {
namespace {

void write_settings(JsonWriter& w, const BakeSettings& settings) {
  w.key("settings").begin_object();
  for (const Setting& row : settings_table()) {
    const auto source = settings.source.find(row.name);
    w.key(row.name).begin_object().pair("value", row.print(settings));
    w.pair("unit", row.unit).pair("set_by", source == settings.source.end() ? "default" : source->second);
    w.end_object();
  }
  w.end_object();
}

void write_times(JsonWriter& w, const char* key, const std::vector<StageTime>& times) {
  w.key(key).begin_array();
  for (const StageTime& s : times)
    w.begin_object()
        .pair("name", s.name)
        .pair("seconds", s.seconds)
        .pair("cpu_seconds", s.cpu_seconds)
        .end_object();
  w.end_array();
}

// `kiln encode` rebuilds the layout from "collapsed".
void write_two_pass(JsonWriter& w, const BakeReport& r) {
  const CollapsedCharts &black = r.atlas.collapsed[kUnlit], &even = r.atlas.collapsed[kEvenlyLit];
  w.key("two_pass").begin_object().pair("samples", r.two_pass.samples);
  w.pair("rays", r.two_pass.rays).pair("worker_seconds", r.two_pass.worker_seconds);
  w.pair("charts_constant", even.charts).pair("charts_black", black.charts);
  w.pair("texels", even.from + black.from).pair("share", r.atlas.share(even.from + black.from));
  w.pair("saved_texels", even.saved() + black.saved()).pair("black_that_met_light", r.two_pass.black_lit);
  w.key("collapsed").begin_object().pair("unseen", r.two_pass.collapsed[kUnseen]);
  w.pair("black", r.two_pass.collapsed[kUnlit]).pair("constant", r.two_pass.collapsed[kEvenlyLit]);
  w.end_object().end_object();
}

void write_atlas(JsonWriter& w, const BakeReport& r) {
  w.key("atlas").begin_object();
  w.pair("layout", r.layout).pair("width", r.width).pair("height", r.height).pair("pages", r.pages);
  w.pair("charts", r.charts).pair("texels", r.plan.texels).pair("valid_texels", r.plan.valid_texels);
  w.pair("kept_charts", r.atlas.kept_charts);
  if (!r.kept_layout.empty()) w.pair("kept_layout_sha256", r.kept_layout);
  if (r.layout == "pack") w.pair("texels_per_metre", double{r.atlas.texels_per_metre});
  write_unseen(w, r.atlas).pair("charts_that_met_light", r.unseen_lit).end_object();
  if (r.settings.two_pass && r.layout == "pack") write_two_pass(w, r);
  w.pair("used_share",
         static_cast<double>(r.owned_texels) / static_cast<double>(std::max<uint64_t>(1, r.plan.texels)));
  w.key("texels_by_class").begin_object();
  for (int i = 0; i < kValidityClasses; ++i)
    w.pair(validity_name(static_cast<Validity>(i)), r.texels_by_class[i]);
  w.end_object();
  write_times(w, "steps", r.atlas.steps);
  w.end_object();
}

void write_passes(JsonWriter& w, const BakeReport& r) {
  w.key("passes").begin_array();
  for (const PassPoint& p : r.passes) {
    w.begin_object()
        .pair("samples", p.samples)
        .pair("kept", p.kept)
        .pair("active_texels", p.active)
        .pair("seconds", p.seconds)
        .pair("seconds_left", p.seconds_left);
    w.pair("rays", p.rays).pair("rms_relative_error", p.rms_relative);
    w.pair("worst_relative_error", p.worst_relative).pair("converged_share", p.converged_share).end_object();
  }
  w.end_array();
}

void write_verification(JsonWriter& w, const Verification& v) {
  w.key("verification").begin_object();
  w.pair("verified", v.verified).pair("unverified", v.unverified).pair("waived", v.waived);
  w.pair("quorum", v.quorum).pair("voters", v.owners_known ? "owners" : "machines");
  w.pair("trusted", v.trusted);
  w.key("unseen").begin_array();  // probabilities; see unseen_probability
  for (const double liars : {0.0, 0.1, 0.3})
    for (const uint64_t wrong : {1, 10, 100})
      w.begin_object()
          .pair("liars", liars)
          .pair("wrong_results", wrong)
          .pair("probability", unseen_probability(v, liars, wrong))
          .end_object();
  w.end_array().key("by").begin_array();
  for (const Contribution& c : v.by)
    w.begin_object()
        .pair("identity", c.identity)
        .pair("gave", c.gave)
        .pair("alone", c.alone)
        .pair("confirmed", c.confirmed)
        .end_object();
  w.end_array().end_object();
}

void write_farm(JsonWriter& w, const FarmStatistics& f) {
  w.key("farm").begin_object();
  w.pair("numeric_class", f.numeric_class).pair("rays", f.rays).pair("units", f.units);
  w.pair("duplicates", f.duplicates).pair("reassigned", f.reassigned).pair("copies", f.copies);
  w.pair("workers_lost", f.workers_lost);
  w.pair("nonfinite_contributions", f.nonfinite).pair("worker_seconds", f.worker_seconds);
  w.pair("rays_per_second_and_thread",
         f.worker_seconds > 0 ? static_cast<double>(f.rays) / f.worker_seconds : 0.0);
  write_verification(w, f.verification);
  w.key("events").begin_array();
  for (const std::string& event : f.events) w.value(event);
  w.end_array().end_object();
}

void write_nonfinite(JsonWriter& w, const BakeReport& r) {
  w.key("nonfinite").begin_array();
  for (const NonfinitePlace& p : r.nonfinite) {
    w.begin_object().pair("x", p.x).pair("y", p.y).pair("page", p.page).pair("instance", p.instance);
    w.pair("site", p.site).pair("sample", p.sample).end_object();
  }
  w.end_array();
}

void write_lamps(JsonWriter& w, const LampReport& lamps) {
  w.key("lamps").begin_object().pair("mode", lamps.mode).pair("others", lamps.others);
  w.pair("sky_in_map", lamps.sky_in_map).key("in_map").begin_array();
  for (const std::string& name : lamps.in_map) w.value(name);
  w.end_array().end_object();
}

void write_lods(JsonWriter& w, const BakeReport& r) {
  w.key("lods").begin_array();
  for (const DisplayFit& f : r.lods) {
    w.begin_object().pair("name", f.name).pair("level", f.level).pair("baked", f.baked);
    w.pair("worst_metres", f.worst).pair("mean_metres", f.mean).pair("worst_texels", f.worst_texels);
    w.pair("limit_metres", f.limit).pair("lookup_shift_texels", f.shift_texels);
    w.key("worst_at").begin_array();
    for (int axis = 0; axis < 3; ++axis) w.value(f.worst_at[axis]);
    w.end_array().pair("triangles", f.triangles).pair("faces", f.faces).end_object();
  }
  w.end_array();
}

void write_probes(JsonWriter& w, const ProbeFigures& p) {
  w.key("probes").begin_object();
  w.pair("volumes", p.volumes).pair("probes", p.probes).pair("inactive", p.inactive).pair("moved", p.moved);
  w.pair("skipped", p.skipped).pair("complete", p.complete).pair("samples", p.samples);
  w.pair("median_relative_error", p.median_relative).pair("p95_relative_error", p.p95_relative);
  w.pair("rays", p.rays).pair("seconds", p.seconds).pair("worker_seconds", p.worker_seconds);
  w.end_object();
}

std::string light_text(const BakeReport& r) {
  const MapStatement& m = r.statement;
  const auto percent = [](double share) {
    return std::isfinite(share) ? text("{:.1f} %", 100 * share) : std::string("unknown");
  };
  std::string out =
      text("median error {}, 95th percentile {}, {} of texels within {:g} %", percent(m.median_relative),
           percent(m.p95_relative), percent(m.within_target), 100 * r.settings.error);
  if (m.never_sampled) out += text("; {} texels never sampled", m.never_sampled);
  return out;
}

}  // namespace

std::string_view validity_name(Validity v) {
  switch (v) {
    case Validity::kEmpty:
      return "empty";
    case Validity::kMeasured:
      return "measured";
    case Validity::kPushed:
      return "pushed";
    case Validity::kFilled:
      return "filled";
    case Validity::kDilated:
      return "dilated";
    case Validity::kInside:
      return "inside";
  }
  return "";
}

std::string statement_text(const BakeReport& r) {
  std::string out = r.settings.quantities.light ? light_text(r) : "";
  for (const ResponseStatement& s : r.responses)
    out += text("{}{}: median error {:.3f}, 95th percentile {:.3f}, {:.1f} % of texels within {:g}",
                out.empty() ? "" : "; ", s.name, s.median_error, s.p95_error, 100 * s.within_target,
                r.settings.visibility_error);
  if (r.probes.volumes > 0)
    out += text("{}{} probes: median error {:.1f} %, 95th percentile {:.1f} %", out.empty() ? "" : "; ",
                r.probes.probes, 100 * r.probes.median_relative, 100 * r.probes.p95_relative);
  return out;
}

std::string_view stopped_by(const BakeReport& r) {
  if (!r.complete || !r.probes.complete) return "time-limit";
  return r.held_back > 0 ? "max-samples" : "error";
}

std::string next_step(const BakeReport& r) {
  if (r.statement.never_sampled > 0)
    return "not every texel was sampled: a longer --time-limit, or a lower --texels-per-metre; `kiln plan` "
           "names the objects that take most of the texels";
  if (!r.complete)
    return "stopped by --time-limit before the map was within --error: give it a longer --time-limit, or a "
           "lower --texels-per-metre";
  if (!r.probes.complete)
    return "stopped by --time-limit before the probes were within --error: give them a longer --time-limit, "
           "or a larger --probe-spacing";
  if (r.held_back > 0)
    return text(
        "stopped by --max-samples {}: {:.1f} % of the texels would need more samples to be within what "
        "is asked; raise it, or ask for less with --error",
        r.settings.most_samples(), 100 * r.held_back);
  return "";
}

std::string report_json(const BakeReport& r) {
  JsonWriter w;
  w.begin_object();
  w.pair("scene", r.scene_path.filename().string()).pair("scene_id", r.scene_id);
  w.pair("complete", r.complete).pair("total_seconds", r.total_seconds);
  w.pair("stopped_by", stopped_by(r)).pair("held_back", r.held_back).pair("next_step", next_step(r));
  w.pair("median_relative_error", r.statement.median_relative);
  w.pair("p95_relative_error", r.statement.p95_relative);
  w.pair("within_target", r.statement.within_target).pair("never_sampled", r.statement.never_sampled);
  w.pair("few_samples", r.statement.few_samples).pair("met_no_light", r.statement.met_no_light);
  w.key("responses").begin_array();
  for (const ResponseStatement& s : r.responses)
    w.begin_object()
        .pair("name", s.name)
        .pair("median_error", s.median_error)
        .pair("p95_error", s.p95_error)
        .pair("within_target", s.within_target)
        .end_object();
  w.end_array();
  if (!r.unmet.empty()) w.pair("unmet", r.unmet);
  write_settings(w, r.settings);
  write_atlas(w, r);
  w.key("plan").begin_object();
  w.pair("triangles", r.plan.triangles).pair("stored_triangles", r.plan.stored_triangles);
  w.pair("coordinator_bytes", r.plan.coordinator_bytes).pair("worker_bytes", r.plan.worker_bytes);
  w.key("left_out").begin_array();
  for (const std::string& s : r.plan.left_out) w.value(s);
  w.end_array().end_object();
  write_objects(w, r.plan.objects);
  write_times(w, "stages", r.stages);
  w.key("post").begin_array();
  for (const Figure& f : r.post)
    w.begin_object().pair("name", f.name).pair("value", f.value).pair("unit", f.unit).end_object();
  w.end_array();
  write_passes(w, r);
  write_farm(w, r.farm);
  write_nonfinite(w, r);
  write_lamps(w, r.lamps);
  write_lods(w, r);
  if (r.probes.volumes > 0) write_probes(w, r.probes);
  write_textures(w, r.textures);
  w.key("notes").begin_array();
  for (const ImportNote& n : r.notes)
    w.begin_object().pair("kind", note_kind(n.kind)).pair("what", n.what).end_object();
  for (const std::string& s : r.warnings)
    w.begin_object().pair("kind", "warning").pair("what", s).end_object();
  w.end_array();
  w.key("outputs").begin_array();
  for (const OutputFile& f : r.outputs)
    w.begin_object()
        .pair("file", f.name)
        .pair("bytes", f.bytes)
        .pair("master", f.master)
        .pair("sha256", f.digest.hex())
        .end_object();
  w.end_array();
  w.key("files").begin_array();
  for (const std::string& name : r.files) w.value(name);
  w.end_array();
  return w.end_object().take();
}

}  // namespace kiln
