// Charts at their size in the world, laid on texel centres and packed. (O'Donnell 2018, chart masks and
// atlas packing; Roughton 2019, 4.1.)
#include <memory>

#include "common/atlas/chart_masks.h"
#include "common/atlas/layout.h"
#include "common/atlas/previous_layout.h"
#include "common/atlas/sites.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/scene/scale.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxPages = 64;

// Rounds down to three digits: a number that is easy to type and still fits.
std::string round_down(double density) {
  const double unit = std::pow(10.0, std::floor(std::log10(density)) - 2);
  return text("{:.6g}", std::floor(density / unit) * unit);
}

// "'a' 70 %, 'b' 12 %": the objects with the most chart area, weighted by density.
std::string largest_charts(const Scene& scene, const std::vector<ChartSize>& sizes) {
  std::vector<double> area(scene.instances.size(), 0);
  double all = 0;
  for (const ChartSize& s : sizes) area[s.instance] += s.square_metres, all += s.square_metres;
  std::string out;
  for (int k = 0; k < 3 && all > 0; ++k) {
    const auto largest = std::max_element(area.begin(), area.end());
    if (!(*largest > 0)) break;
    out += text("{}{} {:.0f} %", out.empty() ? "" : ", ",
                instance_name(scene, static_cast<size_t>(largest - area.begin())), 100 * *largest / all);
    *largest = 0;
  }
  return out;
}

tl::unexpected<Error> too_dense(const Scene& scene, double density, double fitting, uint64_t max_texels,
                                const std::string& largest) {
  if (!(fitting > 0))
    return fail(
        ErrorKind::kInvalidInput,
        text("the scene's charts do not fit {} pages at any density: it has too many charts", kMaxPages));
  const std::string unit = doubt_unit(measure_scale(scene));
  return fail(ErrorKind::kInvalidInput,
              text("{:.6g} texels per metre need more than {} pages or {:.3g} million texels; {} would fit "
                   "(--texels-per-metre). Most of the surface is on {}{}{}",
                   density, kMaxPages, static_cast<double>(max_texels) / 1e6, round_down(fitting), largest,
                   unit.empty() ? "" : "; ", unit));
}

void choose_charts(const Scene& scene, const AtlasSettings& settings, Atlas& atlas) {
  std::vector<ChartsForPacking> made(scene.meshes.size());
  // Large meshes one by one on all threads, then the small ones in parallel.
  constexpr size_t kLarge = 20000;
  const std::vector<uint8_t> wanted = meshes_with_texels(scene);
  const auto make = [&](size_t m, unsigned threads) {
    if (!wanted[m] || !settings.check()) return;
    made[m] = charts_for_packing(scene.meshes[m], settings.unwrap, threads);
  };
  const auto large = [&](size_t m) { return scene.meshes[m].triangles.size() >= kLarge; };
  for (size_t m = 0; m < made.size(); ++m)
    if (large(m)) make(m, settings.threads);
  parallel_for(
      made.size(),
      [&](size_t m) {
        if (!large(m)) make(m, 1);
      },
      settings.threads);
  std::vector<std::string> absent;
  atlas.charts.resize(made.size());
  for (size_t m = 0; m < made.size(); ++m) {
    if (!made[m].complaint.empty())
      atlas.notes.push_back(
          text("mesh {} {}: its charts were made from its faces", mesh_name(scene, m), made[m].complaint));
    else if (made[m].charts.generated)
      absent.push_back(mesh_name(scene, m));
    if (!made[m].limited.empty())
      atlas.notes.push_back(text("mesh {} {}", mesh_name(scene, m), made[m].limited));
    atlas.statistics.generated_meshes += made[m].charts.generated;
    atlas.charts[m] = std::move(made[m].charts);
  }
  if (!absent.empty() && !settings.unwrap.always)
    atlas.notes.push_back(
        text("{} of {} meshes have no TEXCOORD_1, their charts were made from their faces: {}", absent.size(),
             scene.meshes.size(), list_names(absent)));
}

void warn_of_limited(const Scene& scene, const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps,
                     const PackRules& rules, Atlas& atlas) {
  std::vector<std::string> names;
  double widest = 0;  // texels at one texel a metre
  for (size_t p = 0; p < sizes.size(); ++p) {
    if (!steps[p].limited) continue;
    widest = std::max({widest, sizes[p].metres.x, sizes[p].metres.y});
    if (names.empty() || names.back() != instance_name(scene, sizes[p].instance))
      names.push_back(instance_name(scene, sizes[p].instance));
  }
  if (!names.empty())
    atlas.warnings.push_back(
        text("charts larger than a page were made smaller, so these have fewer texels per metre: {}; at "
             "--texels-per-metre {} all charts fit, as they do where these objects have a lower density of "
             "their own (docs/density.md)",
             list_names(names), round_down((rules.most - 1) / widest)));
}

Status check_density(const Scene& scene, const std::vector<float>& density) {
  KILN_CHECK(density.empty() || density.size() == scene.instances.size());
  for (size_t i = 0; i < density.size(); ++i)
    if (!(density[i] > 0 && std::isfinite(density[i])))
      return fail(ErrorKind::kInvalidInput,
                  text("the density of {} is {}: it must be above 0", instance_name(scene, i), density[i]));
  return {};
}

// Cuts and packs charts for one density. Contact cuts depend on the texel size, so another density gives
// another layout.
class Trial {
 public:
  // `base`: the charts of the meshes.
  static Expected<std::unique_ptr<Trial>> at(const Scene& scene, const AtlasSettings& settings,
                                             double density, const Atlas& base) {
    std::unique_ptr<Trial> trial(new Trial(scene, settings, density, base));
    KILN_TRY_STATUS(trial->cut_and_number());
    KILN_TRY_STATUS(settings.check());
    trial->boxes_ = chart_boxes(trial->atlas, settings.threads);
    trial->sizes_ = chart_sizes(scene, trial->atlas, trial->boxes_, settings.density, settings.threads);
    trial->collapse();
    return trial;
  }

  void pack() {
    steps_.resize(sizes_.size());
    for (size_t i = 0; i < sizes_.size(); ++i) steps_[i] = chart_steps(sizes_[i], density_, rules_);
    {
      const StageTimer timer(atlas.statistics.steps, "masks");
      masks_ = chart_masks(atlas, boxes_, sizes_, steps_, rules_, settings_.threads);
      count_collapsed();
    }
    const StageTimer timer(atlas.statistics.steps, "pack");
    const PackSettings pack{.max_page_size = settings_.max_page_size,
                            .max_pages = kMaxPages,
                            .power_of_two = settings_.power_of_two,
                            .cell = rules_.cell};
    PreviousPlaces previous;
    if (settings_.previous)
      previous = match_previous(scene_, atlas, chart_keys(masks_, rules_), *settings_.previous);
    const bool known = std::any_of(previous.places.begin(), previous.places.end(),
                                   [](const auto& place) { return place.has_value(); });
    result = pack_masks(masks_.packed(), masks_.of_placement, pack, known ? &previous : nullptr);
  }

  void apply() {
    if (density_ < settings_.texels_per_metre)
      atlas.notes.push_back(
          text("texels per metre were lowered from {:.6g} to {:.6g}, so that {} x {} x {} pages stay within "
               "{} texels "
               "(--max-texels)",
               settings_.texels_per_metre, density_, result.width, result.height, result.pages,
               settings_.texel_budget));
    atlas.statistics.texels_per_metre = static_cast<float>(density_);
    atlas.statistics.kept_charts = result.kept;
    warn_of_limited(scene_, sizes_, steps_, rules_, atlas);
    apply_packing(result, masks_, boxes_, rules_, atlas);
  }

  uint64_t texels() const { return uint64_t{result.width} * result.height * result.pages; }
  bool within(uint64_t limit) const { return result.fits && texels() <= limit; }
  const std::vector<ChartSize>& sizes() const { return sizes_; }
  // Stop when no chart could become smaller.
  bool is_least() const {
    return std::all_of(steps_.begin(), steps_.end(), [](const Steps& s) { return s.x == 1 && s.y == 1; });
  }

  Atlas atlas;
  PackResult result;

 private:
  Trial(const Scene& scene, const AtlasSettings& settings, double density, const Atlas& base)
      : atlas(base), scene_(scene), settings_(settings), density_(density), rules_(pack_rules(settings)) {
    result.fits = false;
  }
  Status cut_and_number() {
    atlas.charts_of_instance.clear();
    std::vector<uint8_t> receives;
    for (const Instance& instance : scene_.instances) {
      atlas.charts_of_instance.push_back(instance.mesh);
      receives.push_back(instance.receive);
    }
    take_charts_away(scene_, receives, atlas);
    if (settings_.cut_contacts) {
      const StageTimer timer(atlas.statistics.steps, "contacts");
      KILN_TRY_STATUS(cut_at_contacts(scene_, texel_sizes(), settings_, atlas));
    }
    return number_placements(scene_, atlas);
  }

  std::vector<double> texel_sizes() const {
    std::vector<double> texel(scene_.instances.size(), 1 / density_);
    for (size_t i = 0; i < settings_.density.size(); ++i) texel[i] /= settings_.density[i];
    return texel;
  }

  // A chart without extent gets one step each way.
  void collapse() {
    if (!settings_.collapse || sizes_.empty()) return;
    const StageTimer timer(atlas.statistics.steps, "collapse");
    std::vector<uint64_t> texels;
    for (const ChartSize& size : sizes_) {
      const Steps s = chart_steps(size, density_, rules_);
      texels.push_back((uint64_t{s.x} + 1) * (uint64_t{s.y} + 1));
    }
    const std::vector<double> texel = texel_sizes();
    atlas.collapsed = settings_.collapse({atlas, texel, texels});
    KILN_CHECK(atlas.collapsed.size() == sizes_.size());
    whole_ = sizes_;
    for (size_t p = 0; p < sizes_.size(); ++p) {
      if (!atlas.collapsed[p]) continue;
      sizes_[p].metres = DVec2(0.0);
      sizes_[p].square_metres = 0;
    }
  }

  // Savings: masks of the same charts at full size.
  void count_collapsed() {
    AtlasStatistics& count = atlas.statistics;
    std::fill(std::begin(count.collapsed), std::end(count.collapsed), CollapsedCharts{});
    if (std::none_of(atlas.collapsed.begin(), atlas.collapsed.end(), [](uint8_t why) { return why; })) return;
    std::vector<Steps> steps = steps_;
    for (size_t p = 0; p < steps.size(); ++p)
      if (atlas.collapsed[p]) steps[p] = chart_steps(whole_[p], density_, rules_);
    const ChartMasks whole = chart_masks(atlas, boxes_, whole_, steps, rules_, settings_.threads);
    const auto texels = [](const ChartMasks& masks, size_t p) {
      uint64_t bits = 0;
      for_each_bit(masks.texels[masks.of_placement[p]], [&](uint32_t, uint32_t) { ++bits; });
      return bits;
    };
    for (size_t p = 0; p < steps.size(); ++p) {
      if (!atlas.collapsed[p]) continue;
      KILN_CHECK(atlas.collapsed[p] < kCollapseReasons);
      CollapsedCharts& charts = count.collapsed[atlas.collapsed[p]];
      ++charts.charts;
      charts.texels += texels(masks_, p);
      charts.from += texels(whole, p);
    }
  }

  const Scene& scene_;
  const AtlasSettings settings_;
  double density_;
  PackRules rules_;
  std::vector<MeshChartBoxes> boxes_;
  std::vector<ChartSize> sizes_, whole_;  // whole_: sizes without collapsing; empty: nothing collapses
  std::vector<Steps> steps_;
  ChartMasks masks_;
};
using TrialPtr = std::unique_ptr<Trial>;

uint64_t most_texels(const AtlasSettings& settings) {
  const uint64_t page = uint64_t{settings.max_page_size} * settings.max_page_size;
  const uint64_t most = std::min(settings.max_texels, kMaxPages * page);
  return settings.texel_budget ? std::min(most, settings.texel_budget) : most;
}

// Finds the highest density whose pages stay within the budget, on a ladder of fixed densities and from a
// start that depends only on the scene and the budget, so any requested density above gives the same result.
class BudgetSearch {
 public:
  BudgetSearch(const Scene& scene, const AtlasSettings& settings, const Atlas& base)
      : scene_(scene), settings_(settings), base_(base), limit_(most_texels(settings)) {}

  Expected<TrialPtr> run() {
    constexpr int kTries = 10;
    constexpr double kAim = 0.99, kEnough = 0.98;
    high_ = rung_below(settings_.texels_per_metre) + 1;  // rungs from here on are too dense
    KILN_TRY(int64_t rung, start(kAim));
    TrialPtr best;
    for (int tries = 0; tries < kTries || !best; ++tries) {
      rung = std::clamp(rung, low_ + 1, high_ - 1);
      KILN_TRY(TrialPtr trial, at(rung));
      const double share = static_cast<double>(trial->texels()) / static_cast<double>(limit_);
      const bool within = trial->within(limit_), fits = trial->result.fits;
      if (!within && (trial->is_least() || rung == kLowest)) return refuse(*trial);
      (within ? low_ : high_) = rung;
      if (within) best = std::move(trial);
      if ((within && share >= kEnough) || high_ - low_ <= 1) break;
      // Area grows with the square of the density; deviations are found by ever wider steps.
      const double step = fits ? 0.5 * std::log2(kAim / share) : -1.0;
      const int64_t least = within || !fits ? 1 : int64_t{1} << std::min(tries, 10);
      rung += within ? std::max(rungs(step), least) : std::min(rungs(step), -least);
      if (rung <= low_ || rung >= high_) rung = low_ + (high_ - low_) / 2;
    }
    return best;
  }

 private:
  static constexpr double kRungs = 64;  // of a doubling
  static constexpr int64_t kLowest = -4096;
  // Rounded as the report prints it: requested directly, it gives the same layout.
  static double density_of(int64_t rung) {
    return double{static_cast<float>(std::exp2(static_cast<double>(rung) / kRungs))};
  }
  static int64_t rungs(double doublings) { return static_cast<int64_t>(std::floor(doublings * kRungs)); }
  static int64_t rung_below(double density) { return std::max(rungs(std::log2(density)), kLowest); }

  // Estimated from the area of uncut charts.
  Expected<int64_t> start(double aim) {
    AtlasSettings uncut = settings_;
    uncut.cut_contacts = false;
    uncut.collapse = {};
    KILN_TRY(const TrialPtr whole, Trial::at(scene_, uncut, 1, base_));
    double square_metres = 0;
    for (const ChartSize& size : whole->sizes()) square_metres += size.square_metres;
    const double limit = aim * static_cast<double>(limit_);
    const double most = square_metres > 0 ? std::sqrt(limit / square_metres) : 1.0;
    const double density = fitting_density(whole->sizes(), most, pack_rules(settings_), limit);
    return density > 0 ? rung_below(density) : kLowest / 2;
  }

  Expected<TrialPtr> at(int64_t rung) {
    KILN_TRY(TrialPtr trial, Trial::at(scene_, settings_, density_of(rung), base_));
    trial->pack();
    base_.statistics.steps = trial->atlas.statistics.steps;  // total time of all attempts
    return trial;
  }

  tl::unexpected<Error> refuse(const Trial& least) const {
    return fail(
        ErrorKind::kInvalidInput,
        text("{} charts do not fit {} texels (--max-texels) at any density: at their smallest they need "
             "about {:.3g}",
             least.sizes().size(), limit_, texels_needed(least.sizes(), 0, pack_rules(settings_))));
  }

  const Scene& scene_;
  const AtlasSettings& settings_;
  Atlas base_;
  uint64_t limit_;
  int64_t low_ = kLowest - 1, high_ = 0;
};

// At the requested density; nullopt if that exceeds the limit.
Expected<TrialPtr> at_wished_density(const Scene& scene, const AtlasSettings& settings, const Atlas& base) {
  const double wished = settings.texels_per_metre;
  const double limit = static_cast<double>(most_texels(settings));
  const PackRules rules = pack_rules(settings);
  AtlasSettings uncut = settings;
  uncut.cut_contacts = false;
  uncut.collapse = {};
  KILN_TRY(TrialPtr trial, Trial::at(scene, uncut, wished, base));
  // Do not search for contacts at a density that cannot fit.
  if (texels_needed(trial->sizes(), wished, rules) > limit) {
    if (settings.texel_budget) return nullptr;
    return too_dense(scene, wished, fitting_density(trial->sizes(), 0.95 * wished, rules, 0.9 * limit),
                     settings.max_texels, largest_charts(scene, trial->sizes()));
  }
  if (settings.cut_contacts || settings.collapse) {
    KILN_TRY(trial, Trial::at(scene, settings, wished, base));
  }
  if (texels_needed(trial->sizes(), wished, rules) <= limit) trial->pack();
  if (trial->within(most_texels(settings))) return trial;
  if (settings.texel_budget) return nullptr;
  return too_dense(scene, wished, fitting_density(trial->sizes(), 0.95 * wished, rules, 0.9 * limit),
                   settings.max_texels, largest_charts(scene, trial->sizes()));
}

}  // namespace

Expected<Atlas> pack_layout(const Scene& scene, const AtlasSettings& settings) {
  Atlas base;
  base.packed = true;
  KILN_TRY_STATUS(check_density(scene, settings.density));
  {
    const StageTimer timer(base.statistics.steps, "charts");
    choose_charts(scene, settings, base);
    KILN_TRY_STATUS(settings.check());
  }
  if (std::all_of(scene.instances.begin(), scene.instances.end(),
                  [&](const Instance& i) { return base.charts[i.mesh].chart_count == 0; })) {
    KILN_TRY(const TrialPtr empty, Trial::at(scene, settings, settings.texels_per_metre, base));
    return std::move(empty->atlas);
  }
  KILN_TRY(TrialPtr trial, at_wished_density(scene, settings, base));
  if (!trial) {
    KILN_TRY(trial, BudgetSearch(scene, settings, base).run());
  }
  trial->apply();
  return std::move(trial->atlas);
}

Expected<Atlas> layout_packed(const Scene& scene, const AtlasSettings& settings) {
  KILN_TRY(Atlas atlas, pack_layout(scene, settings));
  KILN_TRY_STATUS(settings.check());
  if (atlas.placements.empty()) return atlas;
  SiteOverlap overlap;
  {
    const StageTimer timer(atlas.statistics.steps, "sites");
    KILN_TRY(overlap, find_sites(atlas, settings.threads));
  }
  atlas.statistics.overlapped_points = overlap.points;
  return atlas;
}

}  // namespace kiln
