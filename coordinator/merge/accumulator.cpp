#include "coordinator/merge/accumulator.h"

#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/basis/basis.h"

namespace kiln {

Accumulator::Accumulator(size_t sites, uint32_t basis)
    : basis_(basis),
      planes_(moment_plane_names(basis).size()),
      samples_(sites, 0),
      sums_(sites * planes_, 0.0) {}

Status Accumulator::add(const WorkUnit& unit, const UnitResult& result) {
  if (result.site_count != unit.sites.size() || result.plane_count != planes_ ||
      result.moments.size() != unit.sites.size() * planes_)
    return fail(ErrorKind::kProtocol, text("the result of unit {} has a wrong shape", unit.id));
  if (unit.sites.empty()) return {};
  const uint32_t site = unit.sites.front();
  if (unit.first_sample != samples_[site]) {
    KILN_CHECK(unit.first_sample > samples_[site]);
    waiting_[{site, unit.first_sample}] = {unit, result.moments};
    return {};
  }
  add_in_order(unit, result.moments);
  for (auto next = waiting_.find({site, samples_[site]}); next != waiting_.end();
       next = waiting_.find({site, samples_[site]})) {
    add_in_order(next->second.unit, next->second.moments);
    waiting_.erase(next);
  }
  return {};
}

void Accumulator::add_in_order(const WorkUnit& unit, const std::vector<double>& moments) {
  for (size_t i = 0; i < unit.sites.size(); ++i) {
    const uint32_t site = unit.sites[i];
    KILN_CHECK(samples_[site] == unit.first_sample);
    samples_[site] += unit.sample_count;
    for (size_t p = 0; p < planes_; ++p) sums_[site * planes_ + p] += moments[i * planes_ + p];
  }
}

void Accumulator::clear() {
  std::fill(samples_.begin(), samples_.end(), 0u);
  std::fill(sums_.begin(), sums_.end(), 0.0);
  waiting_.clear();
}

Accumulator::Estimate Accumulator::estimate(uint32_t site) const {
  const double n = samples_[site];
  const double* sum = &sums_[site * planes_];
  Estimate e;
  e.inside = n > 0 && sum[kMomentInside] > 0.5 * n;
  e.pushed = n > 0 && sum[kMomentPushed] > 0.5 * n;
  if (n < 2) {
    e.mean = n > 0 ? sum[kMomentLum] / n : 0;
    e.standard_error = std::numeric_limits<double>::infinity();
    return e;
  }
  e.mean = sum[kMomentLum] / n;
  const double variance = std::max(0.0, (sum[kMomentLum2] - n * e.mean * e.mean) / (n - 1));
  e.standard_error = std::sqrt(variance / n) + 0x1p-20 * e.mean;
  return e;
}

bool Accumulator::converged(uint32_t site, double error, double z) const {
  const Estimate e = estimate(site);
  return e.inside || z * e.standard_error <= error * e.mean;
}

Lightmap Accumulator::resolve(const Atlas& atlas) const {
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  map.validity.assign(atlas.texel_count(), Validity::kEmpty);
  const std::vector<std::string> moments = moment_plane_names(basis_);
  // Plane i of the map is sums plane source[i]; error and samples are computed.
  std::vector<size_t> source;
  for (size_t p : {kMomentER, kMomentEG, kMomentEB}) source.push_back(p);
  for (size_t p = kMomentBasis; p < moments.size(); ++p) source.push_back(p);
  for (size_t p : source) map.planes.add(moments[p]);
  const BasisInfo& basis = basis_roster()[basis_];
  if (basis.functions.size() == 4)
    for (size_t c = 0; c < 3; ++c) map.bounds.push_back({3 + c, {6 + c, 9 + c, 12 + c}});
  map.planes.add("error");
  map.planes.add("samples");
  std::vector<float>& error = map.planes.plane("error");
  std::vector<float>& samples = map.planes.plane("samples");
  for (uint32_t site = 0; site < samples_.size(); ++site) {
    if (samples_[site] == 0) continue;
    const uint32_t texel = atlas.sites.texel[site];
    const Estimate e = estimate(site);
    map.validity[texel] = e.inside ? Validity::kInside : e.pushed ? Validity::kPushed : Validity::kMeasured;
    const double scale = 1.0 / samples_[site];
    for (size_t i = 0; i < source.size(); ++i)
      map.planes.data[i][texel] = static_cast<float>(sums_[site * planes_ + source[i]] * scale);
    error[texel] = static_cast<float>(e.standard_error);
    samples[texel] = static_cast<float>(samples_[site]);
  }
  return map;
}

}  // namespace kiln
