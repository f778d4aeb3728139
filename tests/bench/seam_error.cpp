// seam_error SCENE BAKE HALF0 HALF1 [NAME=VALUE ...]: what joining the seams of a bake does to its error.
// BAKE is the folder of `kiln bake SCENE --seams off --basis irradiance` with the same NAME=VALUE settings
// (by their names of the job file), HALF0 and HALF1 those of a reference (kiln bench --only-reference).
// Prints steps across seams, and relMSE of the texels within two bilinear taps of a seam with and without
// joining.
#include <cstdio>

#include "common/base/format.h"
#include "coordinator/bake/seams/join.h"
#include "coordinator/measure/compare/measures.h"
#include "coordinator/output/context/context.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

Expected<Planes> read_master(const fs::path& folder, const std::string& stem, uint32_t pages) {
  Planes all;
  for (uint32_t page = 0; page < pages; ++page) {
    KILN_TRY(const Planes one, read_exr(folder / page_name(stem, "exr", page, pages)));
    if (page == 0) {
      all = one;
      continue;
    }
    all.height += one.height;
    for (size_t p = 0; p < all.data.size(); ++p)
      all.data[p].insert(all.data[p].end(), one.data[p].begin(), one.data[p].end());
  }
  return all;
}

// The map as the seams stage got it, with E alone.
Expected<Lightmap> read_map(const fs::path& folder, const Atlas& atlas) {
  KILN_TRY(const Planes light, read_master(folder, "irradiance", atlas.pages));
  KILN_TRY(const Planes error, read_master(folder, "error", atlas.pages));
  KILN_TRY(const Planes validity, read_master(folder, "validity", atlas.pages));
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  if (light.width != map.planes.width || light.height != map.planes.height)
    return fail(ErrorKind::kInvalidInput, "the bake has another layout: give it the same settings");
  for (const char* c : {"R", "G", "B"}) {
    map.planes.add(std::string("E.") + c);
    map.planes.data.back() = light.plane(c);
  }
  map.planes.add("error");
  map.planes.data.back() = error.data[0];
  map.planes.add("samples");
  for (size_t t = 0; t < validity.data[0].size(); ++t) {
    const auto v = static_cast<Validity>(static_cast<int>(validity.data[0][t]));
    map.validity.push_back(v == Validity::kDilated ? Validity::kEmpty : v);
  }
  return map;
}

ErrorMap error_map(const Lightmap& map, const std::vector<uint8_t>& chosen) {
  ErrorMap out;
  out.width = map.planes.width;
  out.page_height = map.page_height;
  out.pages = map.planes.height / map.page_height;
  for (size_t t = 0; t < map.validity.size(); ++t) {
    out.light.push_back(light_of(map, t));
    out.stated.push_back(map.planes.plane("error")[t]);
    out.measured.push_back(chosen[t] &&
                           (map.validity[t] == Validity::kMeasured || map.validity[t] == Validity::kPushed));
  }
  return out;
}

// Texels that a lookup within two texels of a seam reads: of the same charts.
std::vector<uint8_t> near_seams(const Atlas& atlas, std::span<const SeamEquation> equations) {
  std::vector<uint8_t> near(atlas.owner.size(), 0);
  for (const SeamEquation& e : equations)
    for (const Lookup& side : e.side)
      for (uint32_t k = 0; k < side.count; ++k) near[side.texel[k]] = 1;
  for (int ring = 0; ring < 2; ++ring) {
    const std::vector<uint8_t> before = near;
    for (size_t t = 0; t < near.size(); ++t) {
      if (!before[t]) continue;
      const size_t x = t % atlas.width, y = t / atlas.width % atlas.height;
      for (const auto& [ok, n] : {std::pair{x > 0, t - 1},
                                  {x + 1 < atlas.width, t + 1},
                                  {y > 0, t - atlas.width},
                                  {y + 1 < atlas.height, t + atlas.width}})
        if (ok && atlas.owner[n] == atlas.owner[t]) near[n] = 1;
    }
  }
  return near;
}

// The texels whose relMSE grew most by joining, and the seam points that say most of them.
void print_worst(const Lightmap& before, const Lightmap& after, const std::vector<uint8_t>& near,
                 const ErrorMap (&half)[2], std::span<const SeamEquation> equations,
                 std::span<const SeamDoubt> doubts) {
  struct Harm {
    double size;
    size_t texel;
  };
  std::vector<Harm> all;
  double mean = 0, count = 0;
  const auto truth = [&](size_t t) { return 0.5 * (half[0].light[t] + half[1].light[t]); };
  const auto counts = [&](size_t t) { return near[t] && half[0].measured[t] && half[1].measured[t]; };
  for (size_t t = 0; t < near.size(); ++t)
    if (counts(t)) mean += truth(t), ++count;
  const double floor = std::pow(kDarkStep * mean / std::max(1.0, count), 2);
  double grown = 0, shrunk = 0;
  for (size_t t = 0; t < near.size(); ++t) {
    if (!counts(t)) continue;
    const double r = truth(t), was = light_of(before, t) - r, is = light_of(after, t) - r;
    all.push_back({(is * is - was * was) / (r * r + floor), t});
    (all.back().size > 0 ? grown : shrunk) += all.back().size / count;
  }
  std::printf("grown by %.4g, shrunk by %.4g; dark %.3g\n", grown, -shrunk, std::sqrt(floor));
  std::stable_sort(all.begin(), all.end(), [](const Harm& a, const Harm& b) { return a.size > b.size; });
  for (size_t i = 0; i < std::min<size_t>(4, all.size()); ++i) {
    const size_t t = all[i].texel;
    std::printf("worse by %.3g: texel (%zu, %zu): %.4g became %.4g, true %.4g; stated %.2g, then %.2g\n",
                all[i].size / count, t % before.planes.width, t / before.planes.width, light_of(before, t),
                light_of(after, t), truth(t), double{before.planes.plane("error")[t]},
                double{after.planes.plane("error")[t]});
    int shown = 0;
    for (size_t r = 0; r < equations.size() && shown < 2; ++r)
      for (int s = 0; s < 2; ++s)
        for (uint32_t k = 0; k < equations[r].side[s].count; ++k) {
          if (equations[r].side[s].texel[k] != t || equations[r].side[s].weight[k] < 0.2f) continue;
          ++shown;
          std::printf("   excess %.2f noise %.3g:", doubts[r].excess, std::sqrt(doubts[r].noise));
          for (const Lookup& side : equations[r].side) {
            for (uint32_t j = 0; j < side.count; ++j)
              std::printf(" %.2f x %u: %.4g (true %.4g, stated %.2g)", double{side.weight[j]}, side.texel[j],
                          light_of(before, side.texel[j]), truth(side.texel[j]),
                          double{before.planes.plane("error")[side.texel[j]]});
            std::printf(&side == &equations[r].side[0] ? " |" : "\n");
          }
        }
  }
}

struct Options {
  fs::path scene, bake, half[2];
  BakeSettings settings;
  bool sweep = false;
};

Status print_row(const Lightmap& map, const SeamSteps& steps, const std::vector<uint8_t>& near,
                 const ErrorMap (&half)[2], const std::string& name) {
  KILN_TRY(const Comparison c, compare_maps(error_map(map, near), half[0], &half[1], {}));
  std::printf("| %s | %zu | %.2f | %.2f | %.2f | %.4g +- %.2g | %+.3f | %.3f | %.2f |\n", name.c_str(),
              size_t(c.texels), 100 * steps.p99, 100 * steps.rms, 100 * steps.largest, c.rel_mse,
              c.rel_mse_error, 100 * c.bias / c.mean_reference,
              c.calibration ? c.calibration->error_ratio : 0,
              c.calibration ? 100 * c.calibration->coverage : 0);
  return {};
}

Status run(const Options& o) {
  std::vector<StageTime> times;
  KILN_TRY(const Preflight pre, run_preflight(o.scene, o.settings, times, [](const BakeProgress&) {}));
  KILN_TRY(const Lightmap map, read_map(o.bake, pre.atlas));
  ErrorMap half[2];
  for (int h = 0; h < 2; ++h) {
    KILN_TRY(half[h], read_error_map(o.half[h]));
  }
  const std::vector<SeamEquation> equations = seams_of(map, pre.imported.scene, pre.atlas, {});
  const std::vector<uint8_t> near = near_seams(pre.atlas, equations);
  std::printf(
      "| seams | texels | 99th percentile of steps, %% | rms, %% | largest, %% | relMSE | bias, %% | true / "
      "stated | covered, %% |\n|---|---|---|---|---|---|---|---|---|\n");
  KILN_TRY_STATUS(print_row(map, measure_steps(map, equations), near, half, "off"));
  KILN_TRY(Lightmap reference, read_map(o.half[0], pre.atlas));
  KILN_TRY(const Lightmap second, read_map(o.half[1], pre.atlas));
  for (size_t p = 0; p < 3; ++p)
    for (size_t t = 0; t < reference.validity.size(); ++t)
      reference.planes.data[p][t] = 0.5f * (reference.planes.data[p][t] + second.planes.data[p][t]);
  KILN_TRY_STATUS(print_row(reference, measure_steps(reference, equations), near, half, "reference"));
  std::vector<SeamWeights> all = {{}};
  if (o.sweep)
    for (const SeamWeights& w : std::vector<SeamWeights>{{.doubt = {.close = 2.5, .part = 4}, .most = 1.5},
                                                         {.doubt = {.change = 1}}})
      all.push_back(w);
  for (const SeamWeights& w : all) {
    Lightmap joined = map;
    const SeamReport r = join_seams(joined, pre.imported.scene, pre.atlas, {}, w);
    KILN_TRY_STATUS(print_row(joined, r.after, near, half,
                              text("seam {:g} slope {:g} reach {} model {:g} close {:g} part {:g} most {:g} "
                                   "change {:g}; {:.1f} % apart; others {:.2f}; sum {:+.3f} %",
                                   w.seam, w.slope, w.reach, w.doubt.model, w.doubt.close, w.doubt.part,
                                   w.most, w.doubt.change, 100 * r.apart, 100 * r.agreed.p99, 100 * r.bias)));
    if (all.size() == 1)
      print_worst(map, joined, near, half, equations, seam_doubts(pre.atlas, map, equations, w.doubt));
  }
  return {};
}

Expected<Options> parse(int argc, char** argv) {
  if (argc < 5) return fail(ErrorKind::kUsage, "seam_error SCENE BAKE HALF0 HALF1 [sweep] [NAME=VALUE ...]");
  Options o{argv[1], argv[2], {argv[3], argv[4]}, {}, false};
  for (int i = 5; i < argc; ++i) {
    const std::string entry = argv[i];
    const size_t equals = entry.find('=');
    if (entry == "sweep") {
      o.sweep = true;
      continue;
    }
    if (equals == std::string::npos) return fail(ErrorKind::kUsage, entry + ": NAME=VALUE is wanted");
    KILN_TRY_STATUS(
        set_option(o.settings, entry.substr(0, equals), entry.substr(equals + 1), "command line"));
  }
  return o;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  const auto options = kiln::parse(argc, argv);
  const kiln::Status done =
      options ? kiln::run(*options) : kiln::Status(tl::unexpected<kiln::Error>(options.error()));
  if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return done ? 0 : 2;
}
