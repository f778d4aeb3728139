#include "coordinator/report/texture_report.h"

#include "common/base/format.h"
#include "coordinator/report/html.h"

namespace kiln {
namespace {

double megatexels_per_second(const TextureFigures& f) {
  return f.seconds > 0 ? static_cast<double>(f.texels) / f.seconds / 1e6 : 0;
}

// Against E at the surface's own normal, then turned ones, which E alone does not have.
std::span<const TextureError::AtNormal> turns_of(const TextureFigures& f) {
  return std::span(f.error.at_normal).first(f.quantity == "irradiance" ? 1 : f.error.at_normal.size());
}

std::string choice_html(const TextureFigures& f) {
  if (f.instead_of.empty()) return "";
  return text(" instead of {}, {:.2f} % rms: the bound is {:.2f} %", escape(f.instead_of), 100 * f.held_of_it,
              100 * f.bound);
}

std::string turns_html(const TextureFigures& f) {
  if (!f.is_light) return "<td>-</td><td>-</td>";
  const auto turns = turns_of(f);
  std::string out = text("<td>{:.2f} % (mean {:+.2f} %)</td><td>", 100 * turns[0].rms, 100 * turns[0].bias);
  for (const TextureError::AtNormal& at : turns.subspan(1))
    out += text("{}{:.2f}", at.degrees > 15 ? " / " : "", 100 * at.rms);
  return out + (turns.size() > 1 ? " %</td>" : "-</td>");
}

void write_place(JsonWriter& w, const char* key, const TextureError::Place& p) {
  w.key(key).begin_object().pair("page", p.page).pair("x", p.x).pair("y", p.y);
  w.pair("relative_rms_error", p.error).end_object();
}

}  // namespace

void write_textures(JsonWriter& w, std::span<const TextureFigures> figures) {
  w.key("textures").begin_array();
  for (const TextureFigures& f : figures) {
    const TextureError& e = f.error;
    w.begin_object().pair("encoding", f.encoding).pair("quantity", f.quantity);
    w.pair("effort", f.effort.empty() ? "none" : f.effort)
        .pair("bits_per_texel", f.bits)
        .pair("bytes", f.bytes);
    w.pair("seconds", f.seconds).pair("megatexels_per_second", megatexels_per_second(f));
    if (f.bound > 0) w.pair("bound", f.bound).pair("error_of_format", f.held);
    if (!f.instead_of.empty()) w.pair("instead_of", f.instead_of).pair("error_of_that", f.held_of_it);
    w.pair("clamped_values", f.clamped).pair("within_bound", f.within_bound);
    w.pair("texels", e.texels).pair("relative_rms_error", e.relative_rms()).pair("rel_mse", e.rel_mse);
    w.pair("rel_mse_at_texels", e.rel_mse_texels).pair("rel_mse_between_texels", e.rel_mse_between);
    w.pair("rel_mse_of_filtering_alone", e.rel_mse_filter).pair("psnr_log_db", e.psnr_log);
    if (f.is_light) {
      w.key("at_normals").begin_array();
      for (const TextureError::AtNormal& at : turns_of(f))
        w.begin_object().pair("degrees", at.degrees).pair("bias", at.bias).pair("rms", at.rms).end_object();
      w.end_array();
    }
    write_place(w, "worst_block", e.worst_block);
    write_place(w, "worst_texel", e.worst_texel);
    if (f.seams) {
      const SeamMatch& s = *f.seams;
      w.key("seams").begin_object().pair("blocks", s.blocks).pair("changed", s.changed);
      w.pair("rms_step_before", s.rms_before).pair("rms_step_after", s.rms_after);
      w.pair("largest_step_before", s.largest_before)
          .pair("largest_step_after", s.largest_after)
          .end_object();
    }
    w.end_object();
  }
  w.end_array();
}

std::string textures_table_html(std::span<const TextureFigures> figures) {
  if (figures.empty()) return "<p>None: --encode none.</p>\n";
  std::string out =
      "<table><tr><th>encoding</th><th>holds</th><th>effort</th><th>bits a "
      "texel</th><th>bytes</th><th>off E, rms</th><th>turned by 15 / 35 / 60 degrees</th><th>over the "
      "hemisphere, rms</th>"
      "<th>relMSE</th><th>of filtering alone</th><th>PSNR (log)</th><th>worst block</th><th>worst texel</th>"
      "<th>step at seams, rms</th><th>Mtexel/s</th></tr>\n";
  for (const TextureFigures& f : figures) {
    const TextureError& e = f.error;
    const auto place = [](const TextureError::Place& p) {
      return text("{:.2f} % at ({}, {}) of page {}", 100 * p.error, p.x, p.y, p.page);
    };
    out += text(
        "<tr{}><td>{}</td><td>{}</td><td>{}</td><td>{:.1f}</td><td>{}</td>{}<td>{:.3f} %</td><td>{:.3g}</td>",
        f.within_bound ? "" : " class=\"dim\"", escape(f.encoding) + choice_html(f), escape(f.quantity),
        f.effort.empty() ? "-" : escape(f.effort), f.bits,
        f.within_bound ? text("{}", f.bytes) : "not written", turns_html(f), 100 * e.relative_rms(),
        e.rel_mse);
    out +=
        text("<td>{:.3g}</td><td>{:.1f} dB</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}</td></tr>\n",
             e.rel_mse_filter, e.psnr_log, place(e.worst_block), place(e.worst_texel),
             f.seams ? text("{:.3f} to {:.3f} %", 100 * f.seams->rms_before, 100 * f.seams->rms_after) : "-",
             megatexels_per_second(f));
  }
  return out +
         "</table>\n<p>All from decoded textures, at texels and midway between four. <b>Off E</b>: what an "
         "engine "
         "evaluates at the surface's own normal against the E of irradiance.exr, to be held against the "
         "reported "
         "error of the bake. <b>Turned</b>, and over 16 normals of the <b>hemisphere</b>: against the same "
         "basis "
         "uncompressed, relative to the light there.</p>\n";
}

std::string textures_summary(std::span<const TextureFigures> figures) {
  std::string out;
  for (const TextureFigures& f : figures) {
    const double mib = static_cast<double>(f.bytes) / (1 << 20);
    const TextureError::AtNormal& shown = f.error.at_normal[0];
    const std::string error = f.is_light ? text("{:.2f} % rms off E at the surface's normal (mean {:+.2f} %)",
                                                100 * shown.rms, 100 * shown.bias)
                                         : text("{:.2f} % rms after decoding", 100 * f.error.relative_rms());
    out += text("textures {}{}: {:.3g} MiB, {}; worst texel {:.1f} %, {:.1f} bits a texel{}\n", f.encoding,
                f.is_light ? (f.quantity == "irradiance" ? " (E)" : "") : text(" ({})", f.quantity), mib,
                error, 100 * f.error.worst_texel.error, f.bits,
                !f.within_bound        ? "; NOT WRITTEN: beyond --max-encode-error"
                : f.instead_of.empty() ? ""
                                       : text("; instead of {}, which is {:.2f} % off (bound {:.2f} %)",
                                              f.instead_of, 100 * f.held_of_it, 100 * f.bound));
  }
  return out;
}

}  // namespace kiln
