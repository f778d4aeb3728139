#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/picture/ramp.h"
#include "coordinator/report/html.h"
#include "coordinator/report/report.h"
#include "coordinator/report/texture_report.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

// A map of the stacked pages, at most 512 texels a side; `color` gives 0 to 255.
template <class Color>
Expected<std::string> map_figure(const Lightmap& map, std::string_view caption, const Color& color) {
  const double step = std::max({1.0, map.planes.width / 512.0, map.planes.height / 512.0});
  const auto width = std::max(1u, static_cast<uint32_t>(map.planes.width / step));
  const auto height = std::max(1u, static_cast<uint32_t>(map.planes.height / step));
  std::vector<uint8_t> rgb;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const size_t t =
          std::min<size_t>(map.planes.height - 1, static_cast<size_t>((y + 0.5) * step)) * map.planes.width +
          std::min<size_t>(map.planes.width - 1, static_cast<size_t>((x + 0.5) * step));
      const Vec3 c = color(t);
      for (int k = 0; k < 3; ++k) rgb.push_back(static_cast<uint8_t>(c[k]));
    }
  KILN_TRY(const Bytes png, encode_png(width, height, rgb));
  return embedded(png, caption);
}

Expected<std::string> maps(const BakeReport& r, const Lightmap& map) {
  const std::vector<float>& samples = map.planes.plane("samples");
  const auto measured = [&](size_t t) { return map.validity[t] == Validity::kMeasured; };
  // In a limited time texels may have fewer than --min-samples.
  float least = static_cast<float>(r.plan.least_samples), most = 1.0f;
  for (size_t t = 0; t < samples.size(); ++t) {
    if (!measured(t)) continue;
    least = std::min(least, samples[t]);
    most = std::max(most, samples[t]);
  }
  const float low = std::log2(std::max(1.0f, least)), span = std::max(1.0f, std::log2(most) - low);
  std::string out;
  KILN_TRY(
      const std::string a,
      map_figure(
          map, text("samples per texel, {:.0f} (dark) to {:.0f} (yellow), logarithmic", least, most),
          [&](size_t t) { return measured(t) ? ramp((std::log2(samples[t]) - low) / span) : Vec3(24); }));
  if (!map.has_light) return a;
  const std::vector<float>& error = map.planes.plane("error");
  KILN_TRY(
      const std::string b,
      map_figure(map, text("reported standard error / E, 0 to {} (yellow: that or more)", r.settings.error),
                 [&](size_t t) {
                   const float e =
                       luminance(Vec3(map.planes.data[0][t], map.planes.data[1][t], map.planes.data[2][t]));
                   if (!measured(t)) return Vec3(24);
                   return e > 0 ? ramp(error[t] / e / static_cast<float>(r.settings.error)) : Vec3(0);
                 }));
  return a + b;
}

// Errors of decoded textures, logarithmic from 0.01 % to 10 % (yellow).
Expected<std::string> texture_maps(const BakeReport& r, const Lightmap& map,
                                   std::span<const std::vector<float>> errors) {
  std::string out;
  for (size_t k = 0; k < std::min(errors.size(), r.textures.size()); ++k) {
    KILN_TRY(
        const std::string figure,
        map_figure(map,
                   text("{} ({}): relative error after decoding, 0.01 % (dark) to 10 % (yellow), logarithmic",
                        r.textures[k].encoding, r.textures[k].quantity),
                   [&](size_t t) {
                     return errors[k][t] > 0 ? ramp((std::log10(errors[k][t]) + 4) / 3) : Vec3(24);
                   }));
    out += figure;
  }
  return out;
}

// Error against run time, both logarithmic, as inline SVG.
std::string curve(const BakeReport& r) {
  std::vector<std::pair<double, double>> points;
  for (const PassPoint& p : r.passes)
    if (p.kept && p.seconds > 0 && p.rms_relative > 0)
      points.emplace_back(std::log10(p.seconds), std::log10(p.rms_relative));
  if (points.size() < 2) return "<p>One pass only: there is no curve.</p>\n";
  double x0 = points.front().first, x1 = points.back().first, y0 = 1e9, y1 = -1e9;
  for (const auto& p : points) y0 = std::min(y0, p.second), y1 = std::max(y1, p.second);
  x1 = std::max(x1, x0 + 0.1), y1 = std::max(y1, y0 + 0.1);
  const auto px = [&](double x) { return 70 + 500 * (x - x0) / (x1 - x0); };
  const auto py = [&](double y) { return 220 - 190 * (y - y0) / (y1 - y0); };
  std::string svg =
      "<svg viewBox=\"0 0 620 270\" width=\"620\" role=\"img\" aria-label=\"error against run time\">"
      "<path d=\"M70 20V220H580\" fill=\"none\" stroke=\"#888\"/>";
  std::string line;
  for (size_t i = 0; i < points.size(); ++i) {
    const double x = px(points[i].first), y = py(points[i].second);
    line += text("{}{:.1f} {:.1f}", i ? "L" : "M", x, y);
    svg += text(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"#e07a3f\"><title>{:.2f} s, {:.2f} "
        "%</title></circle>",
        x, y, std::pow(10, points[i].first), 100 * std::pow(10, points[i].second));
  }
  svg += text("<path d=\"{}\" fill=\"none\" stroke=\"#e07a3f\" stroke-width=\"2\"/>", line);
  for (const auto& p : {points.front(), points.back()}) {
    svg += text("<text x=\"{:.1f}\" y=\"240\" text-anchor=\"middle\">{:.2g} s</text>", px(p.first),
                std::pow(10, p.first));
    svg += text("<text x=\"62\" y=\"{:.1f}\" text-anchor=\"end\">{:.2g} %</text>", py(p.second) + 4,
                100 * std::pow(10, p.second));
  }
  return svg + "<text x=\"325\" y=\"262\" text-anchor=\"middle\">run time of the bake (log)</text></svg>\n";
}

std::string settings_table_html(const BakeSettings& settings) {
  std::string out = "<table><tr><th>setting</th><th>value</th><th>set by</th></tr>\n";
  for (const Setting& row : settings_table()) {
    const auto source = settings.source.find(row.name);
    const bool is_default = source == settings.source.end();
    out += text("<tr{}><td title=\"{}\">{}</td><td>{} {}</td><td>{}</td></tr>\n",
                is_default ? " class=\"dim\"" : "", escape(row.about), row.name, escape(row.print(settings)),
                row.unit, is_default ? "default" : escape(source->second));
  }
  return out + "</table>\n";
}

std::string passes_table(const BakeReport& r) {
  std::string out =
      "<table><tr><th>samples</th><th>texels</th><th>seconds</th><th>rays</th><th>reported error, rms</th>"
      "<th>converged</th></tr>\n";
  for (const PassPoint& p : r.passes)
    out += text(
        "<tr{}><td>{:.0f}{}</td><td>{}</td><td>{:.2f}</td><td>{:.3g} M</td><td>{:.2f} %</td><td>{:.1f} "
        "%</td></tr>\n",
        p.kept ? "" : " class=\"dim\"", p.samples, p.kept ? "" : " (for the cache alone)", p.active,
        p.seconds, p.rays / 1e6, 100 * p.rms_relative, 100 * p.converged_share);
  return out + "</table>\n";
}

std::string notes_html(const BakeReport& r) {
  std::string out = "<ul>\n";
  static const char* kKinds[] = {"baked", "approximated", "ignored", "warning", "note"};
  if (!r.unmet.empty()) out += text("<li><b>failed</b> {}</li>\n", escape(r.unmet));
  for (const std::string& s : r.warnings) out += text("<li><b>warning</b> {}</li>\n", escape(s));
  for (const ImportNote& n : r.notes)
    out += text("<li><b>{}</b> {}</li>\n", kKinds[static_cast<int>(n.kind)], escape(n.what));
  for (const std::string& s : r.plan.left_out) out += text("<li><b>left out</b> {}</li>\n", escape(s));
  return out + "</ul>\n";
}

std::string facts(const BakeReport& r) {
  std::string out = "<table>\n";
  const auto row = [&](std::string_view name, const std::string& value) {
    out += text("<tr><td>{}</td><td>{}</td></tr>\n", name, escape(value));
  };
  row("total time", text("{:.1f} s{}", r.total_seconds, r.complete ? "" : " (stopped by the time limit)"));
  for (const StageTime& s : r.stages) row("- " + s.name, text("{:.2f} s", s.seconds));
  row("rays", text("{:.1f} million", r.farm.rays / 1e6));
  row("rays per second and thread",
      text("{:.2f} million", r.farm.worker_seconds > 0 ? r.farm.rays / r.farm.worker_seconds / 1e6 : 0));
  row("numeric class", r.farm.numeric_class);
  row("triangles", text("{} ({} stored)", r.plan.triangles, r.plan.stored_triangles));
  row("layout",
      text("{}, {} x {}, {} page{}", r.layout, r.width, r.height, r.pages, r.pages == 1 ? "" : "s"));
  row("charts", text("{}", r.charts));
  if (r.layout == "pack")
    row("charts kept in place", r.kept_layout.empty() ? "none: every chart was placed anew (no --keep-layout)"
                                                      : text("{}", r.atlas.kept_charts));
  row("atlas used", text("{:.1f} %", 100.0 * r.owned_texels / std::max<uint64_t>(1, r.plan.texels)));
  for (int i = 0; i < kValidityClasses; ++i)
    row(text("texels {}", validity_name(static_cast<Validity>(i))), text("{}", r.texels_by_class[i]));
  if (!r.lamps.in_map.empty()) {
    const char* fate = r.lamps.mode == "drop"   ? "left out of"
                       : r.lamps.mode == "mark" ? "marked in"
                                                : "kept in";
    row("lamps in the map", text("{}, {} scene.glb", r.lamps.in_map.size(), fate));
  }
  row("units answered twice / reassigned / copied when late",
      text("{} / {} / {}", r.farm.duplicates, r.farm.reassigned, r.farm.copies));
  if (const std::string checked = verification_text(r.farm.verification); !checked.empty())
    row("results checked", checked);
  row("samples beyond the range of a float", text("{}", r.farm.nonfinite));
  for (const NonfinitePlace& p : r.nonfinite)
    row("- first of a unit", text("texel ({}, {}) of page {}, '{}', site {}, sample {}", p.x, p.y, p.page,
                                  p.instance, p.site, p.sample));
  return out + "</table>\n";
}

}  // namespace

Expected<std::string> report_html(const BakeReport& r, const Lightmap& map, const ReportPictures& pictures,
                                  std::span<const std::vector<float>> texture_errors) {
  KILN_TRY(const std::string figures, maps(r, map));
  std::string out = page_head(r.scene_path.filename().string());
  out += text("<p><b>{}</b></p>\n", escape(statement_text(r)));
  if (const std::string next = next_step(r); !next.empty()) out += text("<p>{}</p>\n", escape(next));
  const auto shown = [](const Bytes& png, std::string_view caption) {
    return png.empty() ? std::string() : embedded(png, caption);
  };
  out += shown(pictures.preview, map.has_light
                                     ? "the scene through its lightmap, and the lightmap"
                                     : response_roster()[r.settings.quantities.responses.front()].about);
  for (const auto& [caption, picture] : pictures.responses) out += shown(picture, caption);
  out += "<h2>Error against run time</h2>\n" + curve(r) + passes_table(r);
  out += "<h2>Maps</h2>\n" + figures;
  out += shown(pictures.validity, "validity: where the lightmap's values are from; magenta: inside geometry");
  out += "<h2>Density</h2>\n" + shown(pictures.density, "texels per metre; squares are texels") +
         objects_table_html(r.plan.objects);
  KILN_TRY(const std::string compressed, texture_maps(r, map, texture_errors));
  out += "<h2>Textures</h2>\n" + textures_table_html(r.textures) + compressed;
  out += "<h2>Facts</h2>\n" + facts(r);
  out += "<h2>Findings</h2>\n" + notes_html(r);
  out += "<h2>Settings</h2>\n" + settings_table_html(r.settings);
  out += "<h2>Files</h2>\n<table>\n";
  for (const OutputFile& f : r.outputs)
    out += text("<tr><td>{}</td><td>{} bytes</td><td><code>{}</code></td></tr>\n", f.name, f.bytes,
                f.digest.hex());
  return out + "</table>\n</html>\n";
}

}  // namespace kiln
