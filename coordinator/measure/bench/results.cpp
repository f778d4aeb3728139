#include "coordinator/measure/bench/results.h"

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

void write_run(JsonWriter& w, const BenchRun& r) {
  const Comparison& c = r.comparison;
  w.begin_object()
      .pair("configuration", r.configuration)
      .pair("budget", r.budget)
      .pair("value", r.budget_value);
  w.pair("repeat", r.repeat).pair("seconds", r.seconds).pair("total_seconds", r.total_seconds);
  w.pair("core_seconds", r.core_seconds)
      .pair("rays", r.rays)
      .pair("texels", r.texels)
      .pair("complete", r.complete);
  w.pair("rel_mse", c.rel_mse).pair("rel_mse_error", c.rel_mse_error).pair("rmse", c.rmse());
  if (c.ssim) w.pair("ssim", *c.ssim);
  w.pair("bias", c.bias)
      .pair("bias_error", c.bias_error)
      .pair("mean", c.mean_reference)
      .pair("within", c.within);
  if (c.calibration) {
    w.pair("stated_rms", c.calibration->stated_rms).pair("coverage", c.calibration->coverage);
    w.pair("error_ratio", c.calibration->error_ratio).pair("promised", c.calibration->promised);
    w.pair("promise_kept", c.calibration->promise_kept).pair("stated_rel_mse", c.calibration->stated_rel_mse);
  }
  w.key("settings").begin_object();
  for (const auto& [name, value] : r.settings) w.pair(name, value);
  w.end_object().end_object();
}

std::string_view kind_text(Crossing::Kind kind) {
  return kind == Crossing::Kind::kReached ? "reached"
         : kind == Crossing::Kind::kBelow ? "below"
                                          : "not reached";
}

void write_crossings(JsonWriter& w, const char* key, const Crossing (&crossings)[2]) {
  w.key(key).begin_array();
  for (size_t k = 0; k < 2; ++k) {
    w.begin_object().pair("rel_mse", kTargets[k]).pair("kind", kind_text(crossings[k].kind));
    w.pair("cost", crossings[k].cost).end_object();
  }
  w.end_array();
}

void write_curve(JsonWriter& w, const BenchCurve& curve) {
  w.begin_object().pair("configuration", curve.configuration).key("points").begin_array();
  for (const CurvePoint& p : curve.points) {
    w.begin_object().pair("budget", p.budget).pair("seconds", p.seconds).pair("core_seconds", p.core_seconds);
    w.pair("rays", p.rays).pair("rel_mse", p.rel_mse).end_object();
  }
  w.end_array();
  write_crossings(w, "seconds_to", curve.seconds);
  write_crossings(w, "rays_to", curve.rays);
  w.end_object();
}

}  // namespace

std::string bench_json(const BenchResult& b) {
  JsonWriter w;
  w.begin_object()
      .pair("format", "kiln bench")
      .pair("version", 1)
      .pair("scene", b.scene)
      .pair("machine", b.machine);
  w.pair("texels", b.texels).key("reference").begin_object().pair("key", b.reference_key);
  w.pair("folder", b.reference_folder.string()).pair("samples", b.reference_samples);
  w.pair("share", b.reference_share);
  w.pair("reused", b.reference_reused).pair("rel_mse", b.reference_rel_mse).end_object();
  w.key("curves").begin_array();
  for (const BenchCurve& curve : b.curves) write_curve(w, curve);
  w.end_array().key("runs").begin_array();
  for (const BenchRun& run : b.runs) write_run(w, run);
  return w.end_array().end_object().take();
}

std::string bench_csv(const BenchResult& b) {
  std::string out =
      "scene,configuration,budget,repeat,seconds,total_seconds,core_seconds,rays,texels,rel_mse,rel_mse_"
      "error,bias,"
      "within,stated_rms,coverage,promise_kept,stated_rel_mse\n";
  for (const BenchRun& r : b.runs) {
    const Comparison& c = r.comparison;
    const Calibration k = c.calibration.value_or(Calibration{});
    out += text(
        "{},{},{},{},{:.6g},{:.6g},{:.6g},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
        b.scene, r.configuration, r.budget, r.repeat, r.seconds, r.total_seconds, r.core_seconds, r.rays,
        r.texels, c.rel_mse, c.rel_mse_error, c.bias, c.within, k.stated_rms, k.coverage, k.promise_kept,
        k.stated_rel_mse);
  }
  return out;
}

std::string bench_table(const BenchResult& b) {
  std::string out =
      "| configuration | s to relMSE 1e-3 | s to 1e-4 | rays to 1e-3 | rays to 1e-4 "
      "|\n|---|---|---|---|---|\n";
  for (const BenchCurve& c : b.curves)
    out += text("| {} | {} | {} | {} | {} |\n", c.configuration, crossing_text(c.seconds[0]),
                crossing_text(c.seconds[1]), crossing_text(c.rays[0]), crossing_text(c.rays[1]));
  return out;
}

ErrorPlot bench_plot(const BenchResult& b) {
  ErrorPlot plot;
  plot.panels = {{b.scene, "seconds of baking and the stages after it", "relMSE", {}},
                 {b.scene, "rays", "relMSE", {}}};
  for (const BenchCurve& curve : b.curves) {
    PlotLine seconds{curve.configuration, {}, {}}, rays{curve.configuration, {}, {}};
    for (const CurvePoint& p : curve.points) {
      seconds.x.push_back(p.seconds);
      rays.x.push_back(p.rays);
      seconds.y.push_back(p.rel_mse);
      rays.y.push_back(p.rel_mse);
    }
    plot.panels[0].lines.push_back(std::move(seconds));
    plot.panels[1].lines.push_back(std::move(rays));
  }
  uint32_t repeats = 0;
  for (const BenchRun& run : b.runs) repeats = std::max(repeats, run.repeat + 1);
  plot.footer = text("{} texels, median of {}, {}; reference relMSE {:.1g}", b.texels, repeats, b.machine,
                     b.reference_rel_mse);
  return plot;
}

Status write_bench(const BenchResult& b, const std::filesystem::path& folder) {
  KILN_TRY_STATUS(write_file_atomic(folder / "bench.json", bench_json(b)));
  KILN_TRY_STATUS(write_file_atomic(folder / "bench.csv", bench_csv(b)));
  if (b.runs.empty()) return {};
  const ErrorPlot plot = bench_plot(b);
  SvgCanvas svg(plot.width(), plot.height());
  plot.draw(svg);
  KILN_TRY_STATUS(write_file_atomic(folder / "bench.svg", svg.take()));
  PixelCanvas pixels(plot.width(), plot.height(), 2);
  plot.draw(pixels);
  const Picture& p = pixels.picture();
  return write_png(folder / "bench.png", p.width, p.height, p.rgb);
}

}  // namespace kiln
