#include "coordinator/run/bake_caches.h"

#include "common/math/sequence.h"
#include "coordinator/bake/sampling/cache_draws.h"
#include "coordinator/bake/sampling/first_look.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

void BakeCaches::make_rough(const Accumulator& sums, uint32_t pass, uint32_t stride) {
  clear();
  std::vector<uint8_t> sampled(sums.sites());
  std::vector<IrradianceCache> caches = of_latest(sums, pass);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    for (uint32_t i = 0; i < sums.sites(); ++i) sampled[i] = sums.samples(i, r) > 0;
    fill_between(atlas_, charts_, sampled, stride, caches[r]);
    publish(std::move(caches[r]));
  }
}

void BakeCaches::leave_out(std::span<const uint32_t> sites) {
  left_out_.insert(left_out_.end(), sites.begin(), sites.end());
}

void BakeCaches::begin() {
  clear();
  left_out_.clear();
}

void BakeCaches::renew(Accumulator& sums, uint32_t pass) {
  clear();
  for (IrradianceCache& cache : of_latest(sums, pass)) publish(std::move(cache));
  sums.renew();
}

// By replicate: means of the latest samples, with errors drawn of them.
std::vector<IrradianceCache> BakeCaches::of_latest(const Accumulator& sums, uint32_t pass) const {
  const std::vector<float> noise = independent_variance(sums.statistics(false, false), charts_);
  const std::vector<uint32_t> samples = sums.replicate_samples();
  std::vector<IrradianceCache> caches;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    caches.push_back(sums.cache(r));
    const uint64_t seed = replicate_seed(seed_, r, 0);
    add_noise_draws({noise, samples, sums.cache_samples(r)}, hash_combine(static_cast<uint32_t>(seed), pass),
                    caches.back());
  }
  return caches;
}

// Paths do not end at texels whose mean misleads: they are traced on from there.
void BakeCaches::publish(IrradianceCache cache) {
  for (size_t site = 0; site < misleading_.size(); ++site)
    if (misleading_[site]) cache.irradiance[site] = Vec3(-1.0f);
  for (const uint32_t site : left_out_) cache.irradiance[site] = Vec3(-1.0f);
  digests_.push_back(farm_.add_chunk(write_irradiance_cache(cache)));
}

}  // namespace kiln
