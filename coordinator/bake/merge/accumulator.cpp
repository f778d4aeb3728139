#include "coordinator/bake/merge/accumulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"

namespace kiln {
namespace {

constexpr uint32_t kFewSamples = 8;  // per replicate

// By all threads. Pages that were touched are zeroed sooner than new ones are mapped.
void zero(ZeroedVector<double>& values) {
  for_each_run(values.size(), 0, [&](size_t begin, size_t end) {
    std::fill(values.begin() + static_cast<ptrdiff_t>(begin), values.begin() + static_cast<ptrdiff_t>(end),
              0.0);
  });
}

}  // namespace

Accumulator::Accumulator(size_t sites, const MomentLayout& layout)
    : layout_(layout), planes_(layout.planes()), kept_(planes_), draws_(planes_) {
  const bool draws = layout_.quantities().cache_draws;
  if (draws) draws_ = layout_.cache_draws(), kept_ -= kCacheDraws;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    samples_[r].assign(sites, 0);
    sums_[r] = ZeroedVector<double>(sites * kept_);
    if (!draws) continue;
    has_[r].assign(sites, 0);
    drawn_[r] = ZeroedVector<double>(sites * kCacheDraws);
    latest_[r] = ZeroedVector<Latest>(sites);
    generations_[r].assign(sites, 0);
  }
}

Status Accumulator::add(const WorkUnit& unit, const UnitResult& result) {
  if (result.site_count != unit.sites.size() || result.plane_count != planes_ ||
      result.moments.size() != unit.sites.size() * planes_)
    return fail(ErrorKind::kProtocol, text("the result of unit {} has a wrong shape", unit.id));
  if (unit.sites.empty()) return {};
  KILN_CHECK(unit.replicate < kReplicates);
  const uint32_t site = unit.sites.front();
  const std::vector<uint32_t>& samples = samples_[unit.replicate];
  if (unit.first_sample != samples[site]) {
    KILN_CHECK(unit.first_sample > samples[site]);
    waiting_[{unit.replicate, site, unit.first_sample}] = {unit, result.moments};
    return {};
  }
  add_in_order(unit, result.moments);
  for (auto next = waiting_.find({unit.replicate, site, samples[site]}); next != waiting_.end();
       next = waiting_.find({unit.replicate, site, samples[site]})) {
    add_in_order(next->second.unit, next->second.moments);
    waiting_.erase(next);
  }
  return {};
}

void Accumulator::add_in_order(const WorkUnit& unit, const std::vector<double>& moments) {
  const uint32_t r = unit.replicate;
  std::vector<uint32_t>& samples = samples_[r];
  for (size_t i = 0; i < unit.sites.size(); ++i) {
    const uint32_t site = unit.sites[i];
    KILN_CHECK(samples[site] == unit.first_sample);
    const double* const added = &moments[i * planes_];
    double* const sums = &sums_[r][site * kept_];
    for (size_t p = 0; p < draws_; ++p) sums[p] += added[p];
    for (size_t p = draws_; p < kept_; ++p) sums[p] += added[p + kCacheDraws];
    if (draws_ < planes_) add_for_caches(r, site, unit.sample_count, added);
    samples[site] += unit.sample_count;
  }
}

void Accumulator::add_for_caches(uint32_t r, uint32_t site, uint32_t samples, const double* moments) {
  const double* const drawn = moments + draws_;
  if (!std::all_of(drawn, drawn + kCacheDraws, [](double d) { return d == 0; })) {
    has_[r][site] |= kDrawn;
    for (size_t k = 0; k < kCacheDraws; ++k) drawn_[r][site * kCacheDraws + k] += drawn[k];
  }
  if (samples_[r][site] == 0) generations_[r][site] = generation_;
  if (generations_[r][site] == generation_) return;
  has_[r][site] |= kLatest;
  Latest& latest = latest_[r][site];
  if (latest.generation != generation_) latest = {{}, {}, 0, generation_};
  latest.samples += samples;
  for (size_t c = 0; c < 3; ++c) latest.light[c] += moments[cached_planes() + c];
  for (size_t k = 0; k < kCacheDraws; ++k) latest.drawn[k] += static_cast<float>(drawn[k]);
}

void Accumulator::clear() {
  for (uint32_t r = 0; r < kReplicates; ++r) {
    for (uint32_t site = 0; site < has_[r].size(); ++site) forget_draws(r, site);
    std::fill(samples_[r].begin(), samples_[r].end(), 0u);
    zero(sums_[r]);
  }
  waiting_.clear();
}

void Accumulator::clear(std::span<const uint32_t> sites) {
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (const uint32_t site : sites) {
      samples_[r][site] = 0;
      std::fill_n(&sums_[r][site * kept_], kept_, 0.0);
      if (!has_[r].empty()) forget_draws(r, site);
    }
}

void Accumulator::forget_draws(uint32_t r, uint32_t site) {
  if (has(kDrawn, r, site)) std::fill_n(&drawn_[r][site * kCacheDraws], kCacheDraws, 0.0);
  if (has(kLatest, r, site)) latest_[r][site] = {};
  has_[r][site] = 0;
}

Accumulator::Estimate Accumulator::estimate(uint32_t site) const {
  const double n = samples(site);
  Estimate e;
  e.inside = n > 0 && sum(site, kMomentInside) > 0.5 * n;
  e.pushed = n > 0 && sum(site, kMomentPushed) > 0.5 * n;
  if (!layout_.has_light()) return e;
  e.mean = n > 0 ? sum(site, kMomentLum) / n : 0;
  if (n < 2) {
    e.standard_error = std::numeric_limits<double>::infinity();
    return e;
  }
  const double variance = std::max(0.0, (sum(site, kMomentLum2) - n * e.mean * e.mean) / (n - 1));
  e.standard_error = std::sqrt(variance / n) + 0x1p-20 * e.mean;
  return e;
}

TexelStatistics Accumulator::statistics(bool planes, bool draws) const {
  KILN_CHECK(layout_.has_light());
  TexelStatistics out = statistics_of_planes(kMomentLum, kMomentLum2);
  if (draws && layout_.quantities().cache_draws) {
    for (uint32_t r = 0; r < kReplicates; ++r) {
      out.drawn[r] = ZeroedVector<float>(out.sites * kCacheDraws);
      for_each_index(out.sites, 0, [&](size_t site) {
        if (!out.known[site] || !has(kDrawn, r, site)) return;
        for (size_t k = site * kCacheDraws; k < (site + 1) * kCacheDraws; ++k)
          out.drawn[r][k] = static_cast<float>(drawn_[r][k] / samples_[r][site]);
      });
    }
  }
  if (!planes) return out;
  const size_t functions = 3 * layout_.functions(), apart = layout_.quantities().direct_apart ? 3 : 0;
  out.planes = 3 + functions + apart;
  for (uint32_t r = 0; r < kReplicates; ++r) out.mean[r] = ZeroedVector<float>(out.sites * out.planes);
  for_each_index(out.sites, 0, [&](size_t site) {
    if (!out.known[site]) return;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      const double* sums = &sums_[r][site * kept_];
      const double scale = 1.0 / samples_[r][site];
      float* means = &out.mean[r][site * out.planes];
      for (size_t c = 0; c < 3; ++c) means[c] = static_cast<float>(sums[kMomentER + c] * scale);
      for (size_t p = 0; p < functions; ++p)
        means[3 + p] = static_cast<float>(sums[kMomentBasis + p] * scale);
      for (size_t c = 0; c < apart; ++c)
        means[3 + functions + c] = static_cast<float>(sums[layout_.direct() + c] * scale);
    }
  });
  return out;
}

TexelStatistics Accumulator::statistics_of(size_t response, size_t component) const {
  const size_t first = layout_.response(response) + 2 * component;
  return statistics_of_planes(first, first + 1);
}

std::vector<uint32_t> Accumulator::replicate_samples() const {
  std::vector<uint32_t> out(sites());
  for (size_t site = 0; site < out.size(); ++site) out[site] = std::min(samples_[0][site], samples_[1][site]);
  return out;
}

TexelStatistics Accumulator::statistics_of_planes(size_t first, size_t second) const {
  TexelStatistics out;
  const size_t count = sites();
  out.sites = count;
  out.variance.assign(count, 0.0f);
  out.samples = replicate_samples();
  out.known.assign(count, 0);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    out.luminance[r].assign(count, 0.0f);
  }
  for_each_index(count, 0, [&](size_t index) {
    const auto site = static_cast<uint32_t>(index);
    if (estimate(site).inside || out.samples[site] == 0) return;
    out.known[site] = 1;
    // Pooled within the replicates, without the difference of their means, unless there are too few samples.
    const double n = samples(site);
    double squares = 0;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      const double sum_of_first = sum(site, first, r);
      const double mean = sum_of_first * (1.0 / samples_[r][site]);
      squares += std::max(0.0, sum(site, second, r) - mean * sum_of_first);
      out.luminance[r][site] = static_cast<float>(mean);
    }
    double freedom = n - kReplicates;
    if (out.samples[site] < kFewSamples) {
      const double half = 0.5 * (double{out.luminance[0][site]} - double{out.luminance[1][site]});
      squares += n * half * half;
      freedom += 1;
    }
    out.variance[site] = static_cast<float>(squares / std::max(1.0, freedom));
  });
  return out;
}

size_t Accumulator::cached_planes() const {
  return layout_.quantities().all_light ? layout_.all_light() : size_t{kMomentER};
}

IrradianceCache Accumulator::cache(uint32_t replicate) const {
  IrradianceCache cache;
  cache.irradiance.assign(sites(), Vec3(-1.0f));
  const bool draws = layout_.quantities().cache_draws;
  if (draws) cache.draws.resize(sites());
  for_each_index(sites(), 0, [&](size_t index) {
    const auto site = static_cast<uint32_t>(index);
    const bool latest = has(kLatest, replicate, site);
    const double* sums =
        latest ? latest_[replicate][site].light : &sums_[replicate][site * kept_ + cached_planes()];
    const double n = latest ? latest_[replicate][site].samples : samples_[replicate][site];
    // Rays that hit back faces carry no light, in this texel as in paths reflected here. But a texel whose
    // samples were moved out of geometry has the light outside, and the paths that meet it are inside.
    if (!(n > 0) || estimate(site).inside || sum(site, kMomentPushed) > 0) return;
    const Vec3 e(DVec3(sums[0], sums[1], sums[2]) / n);
    if (!is_finite(e)) return;
    cache.irradiance[site] = e;
    if (!has(kDrawn, replicate, site)) return;
    for (size_t k = 0; k < kCacheDraws; ++k) {
      const float drawn = latest ? latest_[replicate][site].drawn[k]
                                 : static_cast<float>(drawn_[replicate][site * kCacheDraws + k]);
      cache.draws[site].set(k, static_cast<float>(double{drawn} / n));
    }
  });
  return cache;
}

std::vector<uint32_t> Accumulator::cache_samples(uint32_t replicate) const {
  std::vector<uint32_t> out(sites());
  for (size_t site = 0; site < out.size(); ++site)
    out[site] = has(kLatest, replicate, site) ? latest_[replicate][site].samples : samples_[replicate][site];
  return out;
}

Lightmap Accumulator::resolve(const Atlas& atlas) const {
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  map.validity.assign(atlas.texel_count(), Validity::kEmpty);
  // Plane i of the map is the sums' plane source[i]; error and samples are computed.
  std::vector<size_t> source;
  map.has_light = layout_.has_light();
  if (map.has_light) {
    const std::vector<std::string> moments = layout_.names();
    for (size_t p : {kMomentER, kMomentEG, kMomentEB}) source.push_back(p);
    for (size_t p = 0; p < 3 * layout_.functions(); ++p) source.push_back(kMomentBasis + p);
    for (size_t c = 0; layout_.quantities().direct_apart && c < 3; ++c)
      source.push_back(layout_.direct() + c);
    for (size_t p : source) map.planes.add(moments[p]);
    const BasisInfo& basis = basis_roster()[layout_.basis()];
    if (basis.is_bounded) map.bounds = direction_bounds(basis);
    map.planes.add("error");
  }
  map.planes.add("samples");
  std::vector<float>* const error = map.has_light ? &map.planes.plane("error") : nullptr;
  std::vector<float>& samples = map.planes.plane("samples");
  for_each_index(sites(), 0, [&](size_t index) {
    const auto site = static_cast<uint32_t>(index);
    if (this->samples(site) == 0) return;
    const uint32_t texel = atlas.sites.texel[site];
    const Estimate e = estimate(site);
    map.validity[texel] = e.inside ? Validity::kInside : e.pushed ? Validity::kPushed : Validity::kMeasured;
    const double scale = 1.0 / this->samples(site);
    for (size_t i = 0; i < source.size(); ++i)
      map.planes.data[i][texel] = static_cast<float>(sum(site, source[i]) * scale);
    // A few samples of paths that end at a cache may sum to less than nothing, which no light is.
    for (size_t i = 0; map.has_light && i < 3; ++i)
      map.planes.data[i][texel] = std::max(0.0f, map.planes.data[i][texel]);
    if (error) (*error)[texel] = static_cast<float>(e.standard_error);
    samples[texel] = static_cast<float>(this->samples(site));
  });
  resolve_responses(atlas, map);
  return map;
}

void Accumulator::resolve_responses(const Atlas& atlas, Lightmap& map) const {
  const std::vector<uint32_t>& list = layout_.quantities().responses;
  if (!list.empty()) map.response_validity = map.validity;
  for (Planes* planes : {&map.responses, &map.response_error}) {
    planes->width = map.planes.width;
    planes->height = map.planes.height;
  }
  for (size_t k = 0; k < list.size(); ++k) {
    const ResponseInfo& r = response_roster()[list[k]];
    const size_t first = map.responses.data.size();
    for (size_t s = 0; s < r.stored.size(); ++s) map.responses.add(response_plane(r, s));
    for_each_index(sites(), 0, [&](size_t index) {
      const auto site = static_cast<uint32_t>(index);
      if (samples(site) == 0) return;
      float means[kMaxComponents], stored[kMaxComponents];
      for (size_t c = 0; c < r.components; ++c)
        means[c] = static_cast<float>(sum(site, layout_.response(k) + 2 * c) / samples(site));
      r.resolve(means, stored);
      for (size_t s = 0; s < r.stored.size(); ++s)
        map.responses.data[first + s][atlas.sites.texel[site]] = stored[s];
    });
  }
}

}  // namespace kiln
