// Error against the number of samples, on a few hundred texels and a few seeds: of each sampler, or of each
// density of the primary directions. The truth is a bake of the same texels with many samples of another
// seed.
//   build/bin/convergence samplers|densities [--svg FILE] [--reference N] { [--SETTING VALUE]... SCENE }...
// SCENE is a glTF file, or "box": a closed room of 2 m with a lamp of 0.4 m under its ceiling and two blocks.
// Settings hold for the scenes after them; --sun none takes the suns away.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "common/atlas/atlas.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/math/samplers.h"
#include "common/responses/quantities.h"
#include "coordinator/scene/import/import.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bench/log_plot.h"
#include "worker/bake/baker.h"

namespace kiln {
namespace {

constexpr size_t kTexels = 256, kSeeds = 8;
constexpr uint32_t kFirst = 16, kLast = 4096;

struct Variant {
  std::string name;
  Sampler sampler = Sampler::kOwen;
  PrimaryDensity density = PrimaryDensity::kMixed;
};

// Luminances: E, L0 and L1, all of the same texel.
struct Moments {
  double e, l0, l1[3];
  bool inside;
};

Scene box() {
  test::SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.75f)), red = m.lambert(Vec3(0.6f, 0.1f, 0.1f));
  const uint32_t green = m.lambert(Vec3(0.1f, 0.5f, 0.1f)), lamp = m.lambert(Vec3(0.0f), Vec3(17, 12, 4));
  const float s = 2.0f;
  m.quad({0, 0, 0}, {0, 0, s}, {s, 0, 0}, white);  // floor, then ceiling, back, front, left, right
  m.quad({0, s, 0}, {s, 0, 0}, {0, 0, s}, white);
  m.quad({0, 0, 0}, {s, 0, 0}, {0, s, 0}, white);
  m.quad({0, 0, s}, {0, s, 0}, {s, 0, 0}, white);
  m.quad({0, 0, 0}, {0, s, 0}, {0, 0, s}, red);
  m.quad({s, 0, 0}, {0, 0, s}, {0, s, 0}, green);
  m.quad({0.8f, s - 0.01f, 0.8f}, {0.4f, 0, 0}, {0, 0, 0.4f}, lamp);
  m.box({0.3f, 0.0f, 0.3f}, {0.9f, 1.2f, 0.9f}, false, white);
  m.box({1.1f, 0.0f, 1.1f}, {1.7f, 0.6f, 1.7f}, false, white);
  return m.take();
}

// Sums over samples [first, first + count) of each site, added to `sums`.
Status add_samples(const Baker& baker, const std::vector<uint32_t>& sites, uint32_t first, uint32_t count,
                   std::vector<double>& sums) {
  const size_t planes = MomentLayout(1).planes();
  sums.resize(sites.size() * planes, 0.0);
  std::vector<Status> status(sites.size());
  parallel_for(sites.size(), [&](size_t i) {
    const auto result = baker.bake({i, first, count, {sites[i]}});
    if (!result) {
      status[i] = tl::unexpected<Error>(result.error());
      return;
    }
    for (size_t p = 0; p < planes; ++p) sums[i * planes + p] += result->moments[p];
  });
  for (const Status& s : status) KILN_TRY_STATUS(s);
  return {};
}

std::vector<Moments> means(const std::vector<double>& sums, uint32_t samples) {
  const size_t planes = MomentLayout(1).planes();
  std::vector<Moments> out;
  for (size_t at = 0; at < sums.size(); at += planes) {
    const double* s = &sums[at];
    const auto lum = [&](size_t p) {
      return (0.2126 * s[p] + 0.7152 * s[p + 1] + 0.0722 * s[p + 2]) / samples;
    };
    out.push_back({lum(kMomentER),
                   lum(kMomentBasis),
                   {lum(kMomentBasis + 3), lum(kMomentBasis + 6), lum(kMomentBasis + 9)},
                   s[kMomentInside] > 0.5 * samples});
  }
  return out;
}

// Root of the mean over texels of the squared relative error of E, L0 and the vector L1 (relative to L0).
struct Errors {
  double of[3] = {0, 0, 0};
};
Errors errors(const std::vector<Moments>& got, const std::vector<Moments>& truth) {
  double brightest = 0;
  for (const Moments& t : truth) brightest = std::max(brightest, t.e);
  Errors sum;
  double n = 0;
  for (size_t i = 0; i < got.size(); ++i) {
    const Moments &g = got[i], &t = truth[i];
    if (t.inside || !(t.e > 1e-4 * brightest)) continue;
    const auto square = [](double v) { return v * v; };
    sum.of[0] += square((g.e - t.e) / t.e);
    sum.of[1] += square((g.l0 - t.l0) / t.l0);
    for (int k = 0; k < 3; ++k) sum.of[2] += square((g.l1[k] - t.l1[k]) / t.l0);
    ++n;
  }
  for (double& v : sum.of) v = std::sqrt(v / std::max(1.0, n));
  return sum;
}

struct Curve {
  std::vector<uint32_t> samples;
  std::vector<Errors> errors;
};

class Bench {
 public:
  static Expected<Bench> open(const std::string& name, const BakeSettings& settings) {
    Bench b;
    if (name == "box") {
      b.scene_ = box();
    } else {
      KILN_TRY(ImportResult imported, import_scene(name, settings));
      b.scene_ = std::move(imported.scene);
    }
    AtlasSettings a;
    a.layout = AtlasSettings::Layout::kPack;
    a.texels_per_metre = static_cast<float>(name == "box" ? 16 : settings.texels_per_metre);
    KILN_TRY(b.atlas_, build_atlas(b.scene_, a));
    const size_t all = b.atlas_.sites.size();
    for (size_t i = 0; i < std::min(all, kTexels); ++i)
      b.sites_.push_back(static_cast<uint32_t>(i * all / std::min(all, kTexels)));
    return b;
  }

  Status reference(uint32_t samples) {
    TransportSettings settings;
    settings.seed = kSeeds;
    KILN_TRY(const auto baker, Baker::create(scene_, atlas_, settings, 0));
    std::vector<double> sums;
    KILN_TRY_STATUS(add_samples(*baker, sites_, 0, samples, sums));
    truth_ = means(sums, samples);
    return {};
  }

  Expected<Curve> run(const Variant& variant) const {
    Curve mean;
    for (uint64_t seed = 0; seed < kSeeds; ++seed) {
      KILN_TRY(const Curve one, run(variant, seed));
      mean.samples = one.samples;
      mean.errors.resize(one.errors.size());
      for (size_t i = 0; i < one.errors.size(); ++i)
        for (int q = 0; q < 3; ++q)
          mean.errors[i].of[q] += one.errors[i].of[q] * one.errors[i].of[q] / kSeeds;
    }
    for (Errors& e : mean.errors)
      for (double& v : e.of) v = std::sqrt(v);
    return mean;
  }

 private:
  Expected<Curve> run(const Variant& variant, uint64_t seed) const {
    TransportSettings settings;
    settings.seed = seed;
    settings.sampler = variant.sampler;
    settings.primary = variant.density;
    KILN_TRY(const auto baker, Baker::create(scene_, atlas_, settings, 0));
    Curve curve;
    std::vector<double> sums;
    for (uint32_t done = 0, next = kFirst; next <= kLast; done = next, next *= 2) {
      KILN_TRY_STATUS(add_samples(*baker, sites_, done, next - done, sums));
      curve.samples.push_back(next);
      curve.errors.push_back(errors(means(sums, next), truth_));
    }
    return curve;
  }

  Scene scene_;
  Atlas atlas_;
  std::vector<uint32_t> sites_;
  std::vector<Moments> truth_;
};

constexpr const char* kQuantities[] = {"E", "L0", "L1"};

struct Options {
  std::vector<Variant> variants;
  std::vector<int> plotted;  // indices into kQuantities
  uint32_t reference = 65536;
  std::string svg;
};

Status measure(const std::string& scene, const BakeSettings& settings, const Options& options,
               std::vector<std::vector<bench::Panel>>& panels) {
  KILN_TRY(Bench bench, Bench::open(scene, settings));
  KILN_TRY_STATUS(bench.reference(options.reference));
  const std::string name = scene.substr(scene.rfind('/') + 1);
  std::vector<Curve> curves;
  for (const Variant& v : options.variants) {
    KILN_TRY(Curve curve, bench.run(v));
    curves.push_back(std::move(curve));
  }
  for (int q = 0; q < 3; ++q) {
    bench::Panel panel{text("{}: {}", name, kQuantities[q]), {}};
    for (size_t v = 0; v < curves.size(); ++v) {
      std::string row = text("| {} | {} | {} |", name, kQuantities[q], options.variants[v].name);
      bench::Line line{options.variants[v].name, {}, {}};
      for (size_t i = 0; i < curves[v].samples.size(); ++i) {
        const double error = curves[v].errors[i].of[q];
        if (i % 2 == 0) row += text(" {:.3g} |", 100 * error);
        line.x.push_back(curves[v].samples[i]);
        line.y.push_back(std::max(error, 1e-6));
      }
      std::printf("%s\n", row.c_str());
      panel.lines.push_back(std::move(line));
    }
    std::fflush(stdout);
    panels[static_cast<size_t>(q)].push_back(std::move(panel));
  }
  return {};
}

Status bench_all(const std::vector<std::string>& arguments, const Options& defaults) {
  Options options = defaults;
  BakeSettings settings;
  std::printf("| scene | of | | n = 16 | 64 | 256 | 1024 | 4096 |\n|---|---|---|---|---|---|---|---|\n");
  std::vector<std::vector<bench::Panel>> panels(3);
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i].compare(0, 2, "--") != 0) {
      KILN_TRY_STATUS(measure(arguments[i], settings, options, panels));
      continue;
    }
    const std::string name = arguments[i].substr(2), value = i + 1 < arguments.size() ? arguments[++i] : "";
    if (name == "svg")
      options.svg = value;
    else if (name == "reference")
      options.reference = static_cast<uint32_t>(std::stoul(value));
    else if (name == "sun" && value == "none")
      settings.suns.clear();
    else
      KILN_TRY_STATUS(set_option(settings, name, value, "command line"));
  }
  if (options.svg.empty() || panels[0].empty()) return {};
  std::vector<bench::Panel> shown;
  for (int q : options.plotted) {
    const auto& row = panels[static_cast<size_t>(q)];
    shown.insert(shown.end(), row.begin(), row.end());
  }
  return write_file_atomic(options.svg,
                           bench::log_plot(shown, panels[0].size(), "samples", "rms relative error"));
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  using namespace kiln;
  Options options;
  if (argc > 1 && std::strcmp(argv[1], "samplers") == 0) {
    for (uint32_t i = 0; i < kSamplers; ++i)
      options.variants.push_back({std::string(sampler_names()[i]), static_cast<Sampler>(i)});
    options.plotted = {0, 2};
  } else if (argc > 1 && std::strcmp(argv[1], "densities") == 0) {
    options.variants = {{"mixed", Sampler::kOwen, PrimaryDensity::kMixed},
                        {"cosine", Sampler::kOwen, PrimaryDensity::kCosine},
                        {"uniform", Sampler::kOwen, PrimaryDensity::kUniform}};
    options.plotted = {0, 1, 2};
  } else {
    std::fprintf(stderr, "usage: convergence samplers|densities [--svg FILE] [--reference N] SCENE...\n");
    return 2;
  }
  if (Status s = bench_all({argv + 2, argv + argc}, options); !s) {
    std::fprintf(stderr, "%s\n", s.error().message.c_str());
    return exit_status(s.error());
  }
  return 0;
}
