#include "coordinator/bake/plan/advice.h"

#include <algorithm>
#include <numeric>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint64_t kFewTexels = 10000;  // in total: below this nobody minds their distribution
// With a mean below this many texels per object most objects show a single colour; the suggested density
// gives kClear.
constexpr double kCoarse = 64, kClear = 1024;

double share_of(uint64_t part, uint64_t all) {
  return all ? static_cast<double>(part) / static_cast<double>(all) : 0.0;
}

uint64_t texels_of(const std::vector<ObjectPlan>& objects) {
  uint64_t all = 0;
  for (const ObjectPlan& o : objects) all += o.valid_texels;
  return all;
}

std::string name_largest(const std::vector<ObjectPlan>& objects, uint64_t all) {
  const auto largest = std::max_element(
      objects.begin(), objects.end(),
      [](const ObjectPlan& a, const ObjectPlan& b) { return a.valid_texels < b.valid_texels; });
  if (largest == objects.end() || all < kFewTexels || 2 * largest->valid_texels <= all) return {};
  const uint64_t others = all - largest->valid_texels;
  if (others == 0) return {};  // it is alone
  const double even = std::sqrt(share_of(others, largest->valid_texels));
  return text(
      "'{}' takes {:.0f} % of the texels, {:.3g} thousand of {:.3g}: {:.4g} square metres at {:.3g} texels "
      "per "
      "metre. extras.kiln.density {:.2g} on it ({:.2g} texels per metre) would be even: as many as all other "
      "objects have; extras.kiln.receive false leaves it out",
      largest->name, 100 * share_of(largest->valid_texels, all),
      static_cast<double>(largest->valid_texels) / 1e3, static_cast<double>(all) / 1e3,
      largest->square_metres, largest->texels_per_metre, largest->factor * even,
      largest->texels_per_metre * even);
}

std::string call_coarse(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                        const std::vector<ObjectPlan>& objects, uint64_t all) {
  const auto receiving = static_cast<double>(
      std::count_if(objects.begin(), objects.end(), [](const ObjectPlan& o) { return o.receive; }));
  const double mean = static_cast<double>(all) / std::max(1.0, receiving);
  const double density = atlas.statistics.texels_per_metre;
  if (mean >= kCoarse || !(density > 0) || all == 0) return {};
  const double clear = round_up(density * std::sqrt(kClear / mean));
  return text(
      "the map is coarse: {} texels for {:.0f} objects at {:.3g} texels per metre in a scene {:.3g} m wide; "
      "{} gives them about {:.0f} each{}",
      all, receiving, density, widest_side(scene),
      settings.texel_budget ? text("--max-texels {:.0f}", kClear * receiving * 1.5)
                            : text("--texels-per-metre {:g}", clear),
      kClear, settings.texel_budget ? "" : ", if the scene is in metres");
}

}  // namespace

double widest_side(const Scene& scene) {
  Vec3 low(std::numeric_limits<float>::infinity()), high(-low);
  for (const Instance& i : scene.instances)
    for (const Vec3& p : scene.meshes[i.mesh].positions) {
      low = glm::min(low, transform_point(i.to_world, p));
      high = glm::max(high, transform_point(i.to_world, p));
    }
  return max_component(high - low);
}

double round_down(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / unit;
  return unit * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

double round_up(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / unit;
  return unit * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}

std::string largest_objects(const std::vector<ObjectPlan>& objects) {
  std::vector<size_t> order(objects.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return objects[a].valid_texels > objects[b].valid_texels; });
  const uint64_t all = texels_of(objects);
  std::string out;
  for (size_t i = 0; i < std::min<size_t>(3, order.size()); ++i)
    out += text("{}'{}' {:.0f} %", i ? ", " : "", objects[order[i]].name,
                100 * share_of(objects[order[i]].valid_texels, all));
  return out;
}

std::vector<std::string> advise_layout(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                                       const std::vector<ObjectPlan>& objects) {
  std::vector<std::string> advice;
  if (!atlas.packed) return advice;
  const uint64_t all = texels_of(objects);
  for (std::string sentence : {name_largest(objects, all), call_coarse(scene, atlas, settings, objects, all)})
    if (!sentence.empty()) advice.push_back(std::move(sentence));
  return advice;
}

Status check_memory(const Plan& plan, const Atlas& atlas, uint64_t memory) {
  const uint64_t needed = plan.coordinator_bytes + plan.worker_bytes;
  if (needed <= memory) return {};
  const auto gib = [](double bytes) { return bytes / (1 << 30); };
  const double of_texels = static_cast<double>(plan.texel_bytes),
               rest = static_cast<double>(needed) - of_texels;
  const double left = 0.95 * static_cast<double>(memory) - rest;
  std::string way_out = "the scene alone is too large for it: split the scene, or bake on another machine";
  if (left > 0) {
    const double share = left / of_texels;  // of the texels
    const double texels = static_cast<double>(plan.texels) * share;
    way_out =
        atlas.packed
            ? text(
                  "--texels-per-metre {:.3g} or --max-texels {:.3g} million would fit; most texels are on {}",
                  std::floor(1e3 * atlas.statistics.texels_per_metre * std::sqrt(share)) / 1e3,
                  std::floor(texels / 1e5) / 10, largest_objects(plan.objects))
            : text("--resolution {:.0f}x{:.0f} would fit", std::floor(atlas.width * std::sqrt(share)),
                   std::floor(atlas.height * std::sqrt(share)));
  }
  return fail(
      ErrorKind::kInvalidInput,
      text("the bake of {:.3g} million texels needs about {:.1f} GiB, coordinator and worker together, and "
           "this machine has {:.1f}: {}",
           static_cast<double>(plan.valid_texels) / 1e6, gib(static_cast<double>(needed)),
           gib(static_cast<double>(memory)), way_out));
}

}  // namespace kiln
