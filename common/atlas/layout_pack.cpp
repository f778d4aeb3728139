// Charts at their size in the world, laid on texel centres and packed. (O'Donnell 2018, chart masks and
// atlas packing; Roughton 2019, 4.1.)
#include "common/atlas/chart_masks.h"
#include "common/atlas/layout.h"
#include "common/atlas/previous_layout.h"
#include "common/atlas/sites.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxPages = 64;

// Three digits, downwards: a number that a person can type and that fits.
std::string round_down(double density) {
  const double unit = std::pow(10.0, std::floor(std::log10(density)) - 2);
  return text("{:.6g}", std::floor(density / unit) * unit);
}

tl::unexpected<Error> too_dense(double density, double fitting, uint64_t max_texels) {
  if (!(fitting > 0))
    return fail(
        ErrorKind::kInvalidInput,
        text("the scene's charts do not fit {} pages at any density: it has too many charts", kMaxPages));
  return fail(ErrorKind::kInvalidInput,
              text("{:.6g} texels per metre need more than {} pages or {:.3g} million texels; {} would fit "
                   "(--texels-per-metre)",
                   density, kMaxPages, static_cast<double>(max_texels) / 1e6, round_down(fitting)));
}

void choose_charts(const Scene& scene, const AtlasSettings& settings, Atlas& atlas) {
  std::vector<ChartsForPacking> made(scene.meshes.size());
  // Large meshes one after another on all threads, then the small ones side by side.
  constexpr size_t kLarge = 20000;
  const auto make = [&](size_t m, unsigned threads) {
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
      atlas.warnings.push_back(
          text("mesh {} {}: its charts were made from its faces", mesh_name(scene, m), made[m].complaint));
    else if (made[m].charts.generated)
      absent.push_back(mesh_name(scene, m));
    if (!made[m].limited.empty())
      atlas.warnings.push_back(text("mesh {} {}", mesh_name(scene, m), made[m].limited));
    atlas.statistics.generated_meshes += made[m].charts.generated;
    atlas.charts[m] = std::move(made[m].charts);
  }
  if (!absent.empty() && !settings.unwrap.always)
    atlas.warnings.push_back(
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

// One packing at one density.
struct Packing {
  double density = 0;
  std::vector<Steps> steps;
  ChartMasks masks;
  PackResult result;
  uint64_t texels() const { return uint64_t{result.width} * result.height * result.pages; }
  bool within(uint64_t limit) const { return result.fits && texels() <= limit; }
};

class Layout {
 public:
  // `density`: texels per metre that are wished for.
  Layout(const Scene& scene, const AtlasSettings& settings, double density, Atlas& atlas)
      : scene_(scene),
        settings_(settings),
        wanted_(density),
        atlas_(atlas),
        rules_(pack_rules(settings)),
        boxes_(chart_boxes(atlas, settings.threads)),
        sizes_(chart_sizes(scene, atlas, boxes_, settings.density, settings.threads)) {}

  // At the wanted density, or at a lower one that the budget allows.
  Expected<Packing> pack_within() {
    Packing packing = none();
    if (texels_needed(sizes_, wanted_, rules_) <= static_cast<double>(most_texels())) packing = pack(wanted_);
    if (packing.within(most_texels())) return packing;
    if (!settings_.texel_budget) return refuse();
    packing = fit_budget();
    if (!packing.within(most_texels())) return refuse_budget();
    return packing;
  }

  void apply(const Packing& packing) {
    if (packing.density < settings_.texels_per_metre)
      atlas_.warnings.push_back(
          text("texels per metre were lowered from {:.6g} to {:.6g}, so that {} x {} x {} pages stay within "
               "{} texels "
               "(--max-texels)",
               settings_.texels_per_metre, packing.density, packing.result.width, packing.result.height,
               packing.result.pages, settings_.texel_budget));
    atlas_.statistics.texels_per_metre = static_cast<float>(packing.density);
    atlas_.statistics.kept_charts = packing.result.kept;
    warn_of_limited(scene_, sizes_, packing.steps, rules_, atlas_);
    apply_packing(packing.result, packing.masks, boxes_, rules_, atlas_);
  }

 private:
  static Packing none() {
    Packing packing;
    packing.result.fits = false;
    return packing;
  }

  uint64_t most_texels() const {
    const uint64_t page = uint64_t{settings_.max_page_size} * settings_.max_page_size;
    const uint64_t most = std::min(settings_.max_texels, kMaxPages * page);
    return settings_.texel_budget ? std::min(most, settings_.texel_budget) : most;
  }

  Packing pack(double density) {
    Packing p;
    p.density = density;
    p.steps.resize(sizes_.size());
    for (size_t i = 0; i < sizes_.size(); ++i) p.steps[i] = chart_steps(sizes_[i], density, rules_);
    {
      const StageTimer timer(atlas_.statistics.steps, "masks");
      p.masks = chart_masks(atlas_, boxes_, sizes_, p.steps, rules_, settings_.threads);
    }
    const StageTimer timer(atlas_.statistics.steps, "pack");
    const PackSettings pack{.max_page_size = settings_.max_page_size,
                            .max_pages = kMaxPages,
                            .power_of_two = settings_.power_of_two,
                            .cell = rules_.cell};
    PreviousPlaces previous;
    if (settings_.previous)
      previous = match_previous(scene_, atlas_, chart_keys(p.masks, rules_), *settings_.previous);
    const bool known = std::any_of(previous.places.begin(), previous.places.end(),
                                   [](const auto& place) { return place.has_value(); });
    p.result = pack_masks(p.masks.packed(), p.masks.of_placement, pack, known ? &previous : nullptr);
    return p;
  }

  // The highest density found in a few packings whose pages stay within the budget: area follows the square
  // of the density, so each packing says where the next should be.
  Packing fit_budget() {
    constexpr int kTries = 8;
    constexpr double kEnough = 0.98, kAim = 0.99;
    const double limit = static_cast<double>(most_texels());
    double low = 0, high = wanted_;
    double density = fitting_density(sizes_, high, rules_, kAim * limit);
    Packing best = none();
    for (int k = 0; k < kTries && density > 0; ++k) {
      Packing tried = pack(density);
      const double texels = static_cast<double>(tried.texels());
      const bool within = tried.within(most_texels()), fits = tried.result.fits;
      (within ? low : high) = density;
      if (within) best = std::move(tried);
      if (within && texels >= kEnough * limit) break;
      density *= fits ? std::sqrt(kAim * limit / texels) : 0.7;
      if (!(density > low && density < high)) density = 0.5 * (low + high);
    }
    return best;
  }

  tl::unexpected<Error> refuse() const {
    const double limit = 0.9 * static_cast<double>(most_texels());
    return too_dense(wanted_, fitting_density(sizes_, 0.95 * wanted_, rules_, limit), settings_.max_texels);
  }
  tl::unexpected<Error> refuse_budget() const {
    return fail(
        ErrorKind::kInvalidInput,
        text("{} charts do not fit {} texels (--max-texels) at any density: at their smallest they need "
             "about {:.3g}",
             sizes_.size(), most_texels(), texels_needed(sizes_, 0, rules_)));
  }

  const Scene& scene_;
  const AtlasSettings& settings_;
  double wanted_;
  Atlas& atlas_;
  PackRules rules_;
  std::vector<MeshChartBoxes> boxes_;
  std::vector<ChartSize> sizes_;
};

// From the charts of the meshes.
Status cut_and_number(const Scene& scene, const AtlasSettings& settings, double density, Atlas& atlas) {
  atlas.charts.resize(scene.meshes.size());
  atlas.charts_of_instance.clear();
  for (const Instance& instance : scene.instances) atlas.charts_of_instance.push_back(instance.mesh);
  atlas.statistics.cut_charts = 0;
  if (settings.cut_contacts) {
    const StageTimer timer(atlas.statistics.steps, "contacts");
    std::vector<double> texel(scene.instances.size(), 1 / density);
    for (size_t i = 0; i < settings.density.size(); ++i) texel[i] /= settings.density[i];
    cut_at_contacts(scene, texel, settings.threads, atlas);
  }
  return number_placements(scene, atlas);
}

}  // namespace

Expected<Atlas> pack_layout(const Scene& scene, const AtlasSettings& settings) {
  Atlas atlas;
  atlas.packed = true;
  std::vector<StageTime>& steps = atlas.statistics.steps;
  KILN_TRY_STATUS(check_density(scene, settings.density));
  {
    const StageTimer timer(steps, "charts");
    choose_charts(scene, settings, atlas);
  }
  const size_t warnings = atlas.warnings.size();
  double density = settings.texels_per_metre;
  for (bool again = true; again;) {
    KILN_TRY_STATUS(cut_and_number(scene, settings, density, atlas));
    if (atlas.placements.empty()) return atlas;
    Layout layout(scene, settings, density, atlas);
    KILN_TRY(const Packing packing, layout.pack_within());
    // Larger texels are cut elsewhere: once more for them.
    again = settings.cut_contacts && packing.density < density && density == settings.texels_per_metre;
    density = packing.density;
    if (again)
      atlas.warnings.resize(warnings);
    else
      layout.apply(packing);
  }
  return atlas;
}

Expected<Atlas> layout_packed(const Scene& scene, const AtlasSettings& settings) {
  KILN_TRY(Atlas atlas, pack_layout(scene, settings));
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
