#include "coordinator/measure/compare/summary.h"

#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

double percent_of(double part, double whole) {
  return whole != 0 ? 100 * part / whole : 0;
}

std::string calibration_text(const Calibration& k, const CompareSettings& s) {
  std::string out = text(
      "stated   {:.3g} % rms; true error / stated {:.3f}; {:.2f} % of texels within their stated "
      "error at {:g} %; the largest is {:.3g} of the brightest texel\n",
      100 * k.stated_rms, k.error_ratio, 100 * k.coverage, 100 * s.confidence, k.largest_stated);
  if (k.promised)
    out += text("promised {} texels to be within {:g} %: {:.2f} % of them are\n", k.promised, 100 * s.error,
                100 * k.promise_kept);
  if (k.reference_part > 0.1)
    out += text(
        "note     the reference's variance is {:.0f} % of the stated one: shares are too low by what it "
        "adds; "
        "take more samples for the reference\n",
        100 * k.reference_part);
  return out;
}

}  // namespace

std::string comparison_text(const Comparison& c, const CompareSettings& s) {
  std::string out = text("texels   {}\nmean     {:.6g} and {:.6g}\n", c.texels, c.mean_a, c.mean_reference);
  out += text("bias     {:.3g} ({:.3f} %)", c.bias, percent_of(c.bias, c.mean_reference));
  if (c.bias_error > 0)
    out += text(", of the reference +- {:.3g} ({:.3f} %)", c.bias_error,
                percent_of(c.bias_error, c.mean_reference));
  out += text("\nRMSE     {:.4g} ({:.2f} % of the mean)\nrelMSE   {:.4g} +- {:.2g}{}\n", c.rmse(),
              percent_of(c.rmse(), c.mean_reference), c.rel_mse, c.rel_mse_error,
              c.calibration ? text(", stated {:.4g}", c.calibration->stated_rel_mse) : "");
  if (c.reference_rel_mse)
    out += text("of these the reference's own noise has relMSE {:.4g}{}\n", *c.reference_rel_mse,
                c.bias_error > 0 ? ", which is not in the above" : ", which is in the above");
  if (c.ssim) out += text("SSIM     {:.4f}", *c.ssim);
  if (c.ssim)
    out += c.reference_ssim ? text(", of the reference's halves {:.4f}\n", *c.reference_ssim) : "\n";
  out += "error   ";
  for (size_t k = 0; k < std::size(kComparePercentiles); ++k)
    out += text(" {:.3g} % ({}){}", 100 * c.percentiles[k],
                kComparePercentiles[k] == 100 ? "largest" : text("{:g} % of texels", kComparePercentiles[k]),
                k + 1 < std::size(kComparePercentiles) ? "," : "\n");
  out += text("within   {:g} %: {:.2f} % of texels\n", 100 * s.error, 100 * c.within);
  if (c.calibration) out += calibration_text(*c.calibration, s);
  for (const WorstTexel& w : c.worst) {
    out += text("worst    texel ({}, {}){}: {:.5g} and {:.5g}", w.x, w.y,
                w.page ? text(" of page {}", w.page) : "", w.a, w.reference);
    if (w.stated > 0) out += text(", stated +- {:.2g}", w.stated);
    out += w.object.empty() ? "\n" : text(", of '{}'\n", w.object);
  }
  return out;
}

std::string comparison_json(const Comparison& c, const CompareSettings& s) {
  JsonWriter w;
  w.begin_object().pair("texels", c.texels).pair("mean_a", c.mean_a).pair("mean_b", c.mean_reference);
  w.pair("bias", c.bias).pair("bias_error", c.bias_error).pair("mse", c.mse).pair("rmse", c.rmse());
  w.pair("rel_mse", c.rel_mse).pair("rel_mse_error", c.rel_mse_error);
  if (c.reference_rel_mse) w.pair("reference_rel_mse", *c.reference_rel_mse);
  if (c.ssim) w.pair("ssim", *c.ssim);
  if (c.reference_ssim) w.pair("reference_ssim", *c.reference_ssim);
  w.pair("error", s.error).pair("confidence", s.confidence).pair("within", c.within);
  w.key("percentiles").begin_object();
  for (size_t k = 0; k < std::size(kComparePercentiles); ++k)
    w.pair(text("{:g}", kComparePercentiles[k]), c.percentiles[k]);
  w.end_object();
  if (c.calibration) {
    const Calibration& k = *c.calibration;
    w.key("calibration").begin_object().pair("stated_rms", k.stated_rms).pair("coverage", k.coverage);
    w.pair("stated_rel_mse", k.stated_rel_mse)
        .pair("error_ratio", k.error_ratio)
        .pair("largest_stated", k.largest_stated)
        .pair("promised", k.promised)
        .pair("promise_kept", k.promise_kept);
    w.pair("reference_part", k.reference_part).end_object();
  }
  w.key("worst").begin_array();
  for (const WorstTexel& t : c.worst) {
    w.begin_object().pair("x", t.x).pair("y", t.y).pair("page", t.page).pair("a", t.a).pair("b", t.reference);
    w.pair("stated", t.stated).pair("object", t.object).end_object();
  }
  return w.end_array().end_object().take();
}

std::string comparison_csv(const Comparison& c) {
  std::string names =
      "texels,mean_a,mean_b,bias,bias_error,rmse,rel_mse,rel_mse_error,reference_rel_mse,within";
  std::string values =
      text("{},{:.9g},{:.9g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{:.6g}", c.texels, c.mean_a,
           c.mean_reference, c.bias, c.bias_error, c.rmse(), c.rel_mse, c.rel_mse_error,
           c.reference_rel_mse ? text("{:.6g}", *c.reference_rel_mse) : "", c.within);
  for (size_t k = 0; k < std::size(kComparePercentiles); ++k) {
    names += text(",error_{:g}", kComparePercentiles[k]);
    values += text(",{:.6g}", c.percentiles[k]);
  }
  names += ",ssim";
  values += c.ssim ? text(",{:.6g}", *c.ssim) : ",";
  names += ",stated_rms,coverage,error_ratio,promised,promise_kept,reference_part,stated_rel_mse";
  const Calibration k = c.calibration.value_or(Calibration{});
  values += c.calibration
                ? text(",{:.6g},{:.6g},{:.6g},{},{:.6g},{:.6g},{:.6g}", k.stated_rms, k.coverage,
                       k.error_ratio, k.promised, k.promise_kept, k.reference_part, k.stated_rel_mse)
                : ",,,,,,,";
  return names + "\n" + values + "\n";
}

}  // namespace kiln
