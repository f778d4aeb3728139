#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/cli/command.h"
#include "coordinator/imageio/exr.h"

namespace kiln {
namespace {

struct WorstTexel {
  uint32_t x, y;
  double a, b;
};

// Over texels that both maps hold (A = 1 in both where there is an A), of luminance.
struct Difference {
  uint64_t texels = 0;
  double mean_a = 0, mean_b = 0;  // mean luminance
  double rmse = 0;                // of a - b
  double rel_mse = 0;             // mean of (a - b)^2 / (b^2 + (mean_b / 100)^2)
  std::vector<WorstTexel> worst;  // by |a - b| / b
};

std::filesystem::path exr_of(const std::string& name) {
  return std::filesystem::is_directory(name) ? std::filesystem::path(name) / "irradiance.exr"
                                             : std::filesystem::path(name);
}

std::vector<double> luminances(const Planes& p) {
  const auto has = [&](const char* name) {
    return std::find(p.names.begin(), p.names.end(), name) != p.names.end();
  };
  std::vector<double> out(size_t{p.width} * p.height);
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = has("R") && has("G") && has("B")
                 ? 0.2126 * p.plane("R")[i] + 0.7152 * p.plane("G")[i] + 0.0722 * p.plane("B")[i]
                 : p.data[0][i];
  return out;
}

std::vector<bool> held(const Planes& p) {
  std::vector<bool> out(size_t{p.width} * p.height, true);
  for (size_t k = 0; k < p.names.size(); ++k)
    if (p.names[k] == "A")
      for (size_t i = 0; i < out.size(); ++i) out[i] = p.data[k][i] > 0.5f;
  return out;
}

Expected<Difference> difference(const Planes& a, const Planes& b) {
  if (a.width != b.width || a.height != b.height)
    return fail(ErrorKind::kUsage, text("the maps have {}x{} and {}x{} texels: only equal layouts compare",
                                        a.width, a.height, b.width, b.height));
  const std::vector<double> la = luminances(a), lb = luminances(b);
  const std::vector<bool> in_a = held(a), in_b = held(b);
  Difference d;
  for (size_t i = 0; i < la.size(); ++i) {
    if (!in_a[i] || !in_b[i]) continue;
    ++d.texels;
    d.mean_a += la[i];
    d.mean_b += lb[i];
    d.rmse += (la[i] - lb[i]) * (la[i] - lb[i]);
    d.worst.push_back({static_cast<uint32_t>(i % a.width), static_cast<uint32_t>(i / a.width), la[i], lb[i]});
  }
  if (d.texels == 0) return fail(ErrorKind::kUsage, "the maps have no texel in common");
  const auto n = static_cast<double>(d.texels);
  d.mean_a /= n;
  d.mean_b /= n;
  d.rmse = std::sqrt(d.rmse / n);
  const double floor = d.mean_b * d.mean_b * 1e-4;
  for (const WorstTexel& t : d.worst) d.rel_mse += (t.a - t.b) * (t.a - t.b) / (t.b * t.b + floor) / n;
  const auto badness = [&](const WorstTexel& t) { return (t.a - t.b) * (t.a - t.b) / (t.b * t.b + floor); };
  std::sort(d.worst.begin(), d.worst.end(),
            [&](const WorstTexel& x, const WorstTexel& y) { return badness(x) > badness(y); });
  d.worst.resize(std::min<size_t>(d.worst.size(), 5));
  return d;
}

void print_json(const Difference& d) {
  JsonWriter w;
  w.begin_object().pair("texels", d.texels).pair("mean_a", d.mean_a).pair("mean_b", d.mean_b);
  w.pair("bias", d.mean_a - d.mean_b)
      .pair("rmse", d.rmse)
      .pair("rel_mse", d.rel_mse)
      .key("worst")
      .begin_array();
  for (const WorstTexel& t : d.worst)
    w.begin_object().pair("x", t.x).pair("y", t.y).pair("a", t.a).pair("b", t.b).end_object();
  std::fputs(w.end_array().end_object().take().c_str(), stdout);
}

int run(const Arguments& arguments, const BakeSettings&) {
  const auto a = read_exr(exr_of(arguments.get("a")));
  if (!a) return report_error(a.error());
  const auto b = read_exr(exr_of(arguments.get("b")));
  if (!b) return report_error(b.error());
  const auto d = difference(*a, *b);
  if (!d) return report_error(d.error());
  if (arguments.has("json")) {
    print_json(*d);
    return 0;
  }
  std::printf(
      "texels   %llu\nmean     %.6g and %.6g\nbias     %.3g (%.3f %%)\nRMSE     %.4g (%.2f %% of the "
      "mean)\nrelMSE   %.4g\n",
      static_cast<unsigned long long>(d->texels), d->mean_a, d->mean_b, d->mean_a - d->mean_b,
      d->mean_b != 0 ? 100 * (d->mean_a / d->mean_b - 1) : 0.0, d->rmse,
      d->mean_b != 0 ? 100 * d->rmse / d->mean_b : 0.0, d->rel_mse);
  for (const WorstTexel& t : d->worst)
    std::printf("worst    texel (%u, %u): %.5g and %.5g\n", t.x, t.y, t.a, t.b);
  return 0;
}

}  // namespace

Command compare_command() {
  return {"compare",
          "Error between two bakes of one layout, or two EXR files: bias, RMSE, relMSE, worst texels",
          "kiln compare out reference",
          {{"a", "A", "output folder or EXR", true},
           {"b", "B", "the reference", true},
           {"--json", "", "print JSON"}},
          false,
          run};
}

}  // namespace kiln
