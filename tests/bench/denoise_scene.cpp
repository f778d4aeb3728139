// What the denoiser makes of a part of a real scene at the samples that a first look has:
//   denoise_scene SCENE FOLDER NAME=VALUE ...
// NAME=VALUE: settings by their names of the job file (texels_per_metre=8 environment=1,1,1 ...), and
//   sites=N   so many texels that lie together (30000), `at`=0..1 where in the order of the atlas (0.5)
//   reference=N  samples a replicate of the reference (256)
//   views=0|1    links between texels that see other things are parted (1;
//   coordinator/bake/neighbours/views.h) worst=N      names so many texels with the largest relative errors
//   (0) levels=N     texels are joined so many times two by two (-1: as a bake does;
//   coordinator/bake/denoise/coarse.h)
// The samples are kept in FOLDER, so that a second run only filters. Prints relMSE raw and denoised, their
// ratio, SSIM, coverage of 95 % and true / stated error, and writes pictures of the atlas around the texels.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/bake/denoise/coarse.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/neighbours/pieces.h"
#include "coordinator/bake/neighbours/views.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/imageio.h"
#include "worker/bake/baker.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

struct Part {
  size_t first = 0, count = 0;
};

struct Lab {
  Preflight pre;
  SiteGeometry sites;
  SurfaceLinks links;
  Part part;
  fs::path folder;
  std::unique_ptr<Baker> baker;
  BakeSettings settings;
  uint64_t seed = 0;
};

void fail_with(const Error& e) {
  std::fprintf(stderr, "%s\n", e.message.c_str());
  std::exit(1);
}

Baker& baker_of(Lab& lab) {
  if (!lab.baker) {
    TransportSettings t;
    t.max_bounces = lab.settings.max_bounces;
    auto made = Baker::create(lab.pre.imported.scene, lab.pre.atlas, t, 2);
    if (!made) fail_with(made.error());
    lab.baker = std::move(*made);
  }
  return *lab.baker;
}

// Samples [first, first + count) of the part, in both replicates; moments from a file where it is there.
TexelStatistics statistics_of(Lab& lab, uint32_t first, uint32_t count) {
  constexpr size_t kRun = 256;
  Accumulator sums(lab.pre.atlas.sites.size(), MomentLayout(1));
  const fs::path file =
      lab.folder / text("samples_{}_{}_{}_{}.bin", lab.pre.atlas.sites.size(), lab.part.first, first, count);
  std::ifstream in(file, std::ios::binary);
  std::vector<std::vector<double>> kept(2 * ((lab.part.count + kRun - 1) / kRun));
  const bool known = in.good();
  std::vector<WorkUnit> units(kept.size());
  for (size_t u = 0; u < units.size(); ++u) {
    units[u].id = u;
    units[u].replicate = u % 2;
    units[u].first_sample = first;
    units[u].sample_count = count;
    const size_t begin = u / 2 * kRun;
    for (size_t i = begin; i < std::min(lab.part.count, begin + kRun); ++i)
      units[u].sites.push_back(static_cast<uint32_t>(lab.part.first + i));
  }
  if (!known) baker_of(lab);
  const auto bake = [&](size_t u) {
    const auto result = lab.baker->bake(units[u], nullptr);
    if (!result) fail_with(result.error());
    kept[u] = result->moments;
  };
  if (!known) parallel_for(units.size(), bake);
  std::ofstream out;
  if (!known) out.open(file, std::ios::binary);
  for (size_t u = 0; u < units.size(); ++u) {
    const size_t planes = MomentLayout(1).planes();
    if (known) {
      kept[u].resize(units[u].sites.size() * planes);
      in.read(reinterpret_cast<char*>(kept[u].data()), static_cast<std::streamsize>(kept[u].size() * 8));
    } else {
      out.write(reinterpret_cast<const char*>(kept[u].data()),
                static_cast<std::streamsize>(kept[u].size() * 8));
    }
    WorkUnit unit = units[u];
    unit.first_sample = 0;
    UnitResult result;
    result.unit = u;
    result.site_count = static_cast<uint32_t>(unit.sites.size());
    result.plane_count = static_cast<uint32_t>(planes);
    result.moments = std::move(kept[u]);
    if (const Status s = sums.add(unit, result); !s) fail_with(s.error());
  }
  return sums.statistics();
}

double mean_of(const TexelStatistics& s, size_t i) {
  return 0.5 * (double{s.luminance[0][i]} + double{s.luminance[1][i]});
}

struct Measures {
  double raw = 0, denoised = 0, raw_covered = 0, covered = 0, raw_ratio = 0, ratio = 0, sum = 0, light = 0;
  double stated_median = 0, stated_p95 = 0;
};

Measures measure(const Lab& lab, const TexelStatistics& s, const Denoised& d, const TexelErrors& raw_errors,
                 const TexelStatistics& reference) {
  Measures m;
  double mean = 0;
  std::vector<double> stated;
  size_t n = 0;
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i)
    if (reference.known[i]) mean += mean_of(reference, i), ++n;
  mean /= static_cast<double>(n);
  size_t counted = 0;
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i) {
    if (!reference.known[i] || !s.known[i]) continue;  // inside geometry as far as is known: filled
    const double t = mean_of(reference, i), floor = 0.01 * mean, unit = 1 / (t * t + floor * floor);
    const double half = 0.5 * (double{reference.luminance[0][i]} - double{reference.luminance[1][i]});
    const double noise = half * half;
    const double a = mean_of(s, i) - t, b = d.luminance[i] - t;
    m.raw += unit * (a * a - noise);
    m.denoised += unit * (b * b - noise);
    const double sr = raw_errors.standard_error[i], sd = d.standard_error[i];
    m.raw_covered += std::abs(a) <= 1.96 * std::sqrt(sr * sr + noise);
    m.covered += std::abs(b) <= 1.96 * std::sqrt(sd * sd + noise);
    m.raw_ratio += unit * sr * sr;
    m.ratio += unit * sd * sd;
    m.sum += b;
    m.light += t;
    stated.push_back(sd / std::max(t, floor));
    ++counted;
  }
  m.raw_ratio = std::sqrt(m.raw / m.raw_ratio);
  m.ratio = std::sqrt(std::max(0.0, m.denoised) / m.ratio);
  for (double* v : {&m.raw, &m.denoised, &m.raw_covered, &m.covered}) *v /= static_cast<double>(counted);
  std::sort(stated.begin(), stated.end());
  m.stated_median = stated[stated.size() / 2];
  m.stated_p95 = stated[stated.size() * 95 / 100];
  return m;
}

// The texels that decide the squared error, with what is around them.
void print_worst(const Lab& lab, const TexelStatistics& s, const Denoised& d,
                 const TexelStatistics& reference, size_t count) {
  const std::vector<uint8_t> all(s.sites, 1);
  const std::vector<uint32_t> piece = surface_pieces(all, lab.links);
  const std::vector<uint32_t> size = piece_sizes(piece);
  double mean = 0, total = 0;
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i)
    mean += mean_of(reference, i) / static_cast<double>(lab.part.count);
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i) {
    if (!reference.known[i] || !s.known[i]) continue;
    const double t = mean_of(reference, i), e = d.luminance[i] - t;
    order.push_back({e * e / (t * t + 1e-4 * mean * mean), i});
    total += order.back().first;
  }
  std::sort(order.rbegin(), order.rend());
  for (size_t k = 0; k < std::min(count, order.size()); ++k) {
    const size_t i = order[k].second;
    std::printf(
        "  %4.1f %%  site %zu piece %u  true %.2g  raw %.2g %.2g  filtered %.2g +- %.2g  around (true)",
        100 * order[k].first / total, i, size[piece[i]], mean_of(reference, i) / mean,
        s.luminance[0][i] / mean, s.luminance[1][i] / mean, d.luminance[i] / mean,
        d.standard_error[i] / mean);
    for (const uint32_t j : lab.links.of(static_cast<uint32_t>(i)))
      std::printf(" %.2g", mean_of(reference, j) / mean);
    std::printf("\n");
  }
}

// The window of the atlas, 768 texels wide, that holds the most of the part.
struct Window {
  size_t x = 0, y = 0, width = 0, height = 0;
};
Window window_of(const Lab& lab) {
  const Atlas& atlas = lab.pre.atlas;
  const size_t rows = size_t{atlas.height} * atlas.pages, side = 64;
  const size_t bx = (atlas.width + side - 1) / side, by = (rows + side - 1) / side;
  std::vector<uint32_t> count(bx * by);
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i) {
    const uint32_t t = atlas.sites.texel[i];
    ++count[t / atlas.width / side * bx + t % atlas.width / side];
  }
  Window best;
  uint64_t most = 0;
  const size_t wide = std::min<size_t>(12, bx), high = std::min<size_t>(8, by);
  for (size_t y = 0; y + high <= by; ++y)
    for (size_t x = 0; x + wide <= bx; ++x) {
      uint64_t sum = 0;
      for (size_t j = 0; j < high; ++j)
        for (size_t k = 0; k < wide; ++k) sum += count[(y + j) * bx + x + k];
      if (sum <= most) continue;
      most = sum;
      best = {x * side, y * side, std::min<size_t>(wide * side, atlas.width - x * side),
              std::min<size_t>(high * side, rows - y * side)};
    }
  return best;
}

void write_window(const Lab& lab, const Window& w, const std::string& name, double unit,
                  const std::function<double(size_t)>& value) {
  const Atlas& atlas = lab.pre.atlas;
  std::vector<uint8_t> rgb(w.width * w.height * 3, 30);
  for (size_t i = lab.part.first; i < lab.part.first + lab.part.count; ++i) {
    const size_t x = atlas.sites.texel[i] % atlas.width, y = atlas.sites.texel[i] / atlas.width;
    if (x < w.x || y < w.y || x >= w.x + w.width || y >= w.y + w.height) continue;
    const double v = std::clamp(value(i) / unit, 0.0, 1.0);
    std::fill_n(&rgb[((y - w.y) * w.width + x - w.x) * 3], 3,
                static_cast<uint8_t>(std::lround(255 * std::pow(v, 1 / 2.2))));
  }
  if (const Status s =
          write_png(lab.folder / name, static_cast<uint32_t>(w.width), static_cast<uint32_t>(w.height), rgb);
      !s)
    fail_with(s.error());
}

int run(int argc, char** argv) {
  Lab lab;
  lab.folder = argv[2];
  fs::create_directories(lab.folder);
  size_t sites = 30000;
  double at = 0.5;
  uint32_t reference_samples = 256;
  int levels = -1;
  size_t worst = 0;
  bool views = true;
  for (int i = 3; i < argc; ++i) {
    const std::string entry = argv[i];
    const size_t equals = entry.find('=');
    const std::string name = entry.substr(0, equals), value = entry.substr(equals + 1);
    if (name == "sites")
      sites = std::stoul(value);
    else if (name == "at")
      at = std::stod(value);
    else if (name == "reference")
      reference_samples = static_cast<uint32_t>(std::stoul(value));
    else if (name == "views")
      views = value == "1";
    else if (name == "worst")
      worst = std::stoul(value);
    else if (name == "levels")
      levels = std::stoi(value);
    else if (const Status s = set_option(lab.settings, name, value, "command line"); !s)
      fail_with(s.error());
  }
  std::vector<StageTime> times;
  auto pre = run_preflight(argv[1], lab.settings, times, [](const BakeProgress&) {});
  if (!pre) fail_with(pre.error());
  lab.pre = std::move(*pre);
  const size_t all = lab.pre.atlas.sites.size();
  lab.part.count = std::min(sites, all);
  lab.part.first = static_cast<size_t>(at * static_cast<double>(all - lab.part.count));
  lab.sites = site_geometry(lab.pre.imported.scene, lab.pre.atlas, 0);
  lab.links = surface_links(lab.pre.imported.scene, lab.pre.atlas, lab.sites, 0);
  if (views) {
    const auto start = std::chrono::steady_clock::now();
    const size_t all = lab.links.link.size() / 2;
    const ViewLinks seen = *link_by_view(lab.pre.imported.scene, lab.sites, 0, 1e9, lab.links);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::printf("%zu of %zu links parted by view, %zu added in %.2f s\n", seen.parted, all, seen.added,
                seconds.count());
  }
  const DirectionBound bounds[3] = {{3, {6, 9, 12}}, {4, {7, 10, 13}}, {5, {8, 11, 14}}};
  const TexelStatistics reference = statistics_of(lab, 4096, reference_samples);
  const std::vector<uint32_t> charts = charts_of_sites(lab.pre.atlas);
  const Window window = window_of(lab);
  double unit = 0, n = 0;
  for (size_t i = 0; i < all; ++i)
    if (reference.known[i]) unit += mean_of(reference, i), n += 1;
  unit *= 2.5 / n;
  write_window(lab, window, "reference.png", unit, [&](size_t i) { return mean_of(reference, i); });
  std::printf("%zu texels, %zu of them here\n", all, lab.part.count);
  for (const uint32_t samples : {1u, 4u, 16u, 64u}) {
    const TexelStatistics s = statistics_of(lab, 0, samples);
    const TexelErrors errors = estimate_errors(s, charts);
    const auto start = std::chrono::steady_clock::now();
    const Denoised d = denoise_joined(s, bounds, lab.sites, lab.links,
                                      levels < 0 ? denoise_levels(s) : static_cast<uint32_t>(levels), 1);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const Measures m = measure(lab, s, d, errors, reference);
    std::printf(
        "%3u samples: relMSE %.3g -> %.3g (x %.3f)  covered %.1f -> %.1f %%  true/stated %.2f -> %.2f  "
        "stated median %.1f %% p95 %.1f %%  sum %+.2f %%  %.1f us\n",
        2 * samples, m.raw, m.denoised, m.denoised / m.raw, 100 * m.raw_covered, 100 * m.covered, m.raw_ratio,
        m.ratio, 100 * m.stated_median, 100 * m.stated_p95, 100 * m.sum / m.light,
        1e6 * seconds.count() / static_cast<double>(lab.part.count));
    if (worst > 0) print_worst(lab, s, d, reference, worst);
    write_window(lab, window, text("raw_{}.png", 2 * samples), unit, [&](size_t i) { return mean_of(s, i); });
    write_window(lab, window, text("denoised_{}.png", 2 * samples), unit,
                 [&](size_t i) { return double{d.luminance[i]}; });
    write_window(lab, window, text("stated_{}.png", 2 * samples), unit,
                 [&](size_t i) { return double{d.standard_error[i]}; });
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("denoise_scene SCENE FOLDER [NAME=VALUE ...]\n", stderr);
    return 2;
  }
  return kiln::run(argc, argv);
}
