#include "coordinator/farm/dispatch/result_check.h"

#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

// Impossible sums: counts beyond the samples, and negative sums of nonnegative quantities. Where paths end at
// a cache, what they add to its light may be negative (worker/integrators/path.h), and a few samples' sum
// with it.
const char* impossible(const double* sums, double samples, bool cached, const MomentLayout& layout) {
  if (sums[kMomentInside] < 0 || sums[kMomentInside] > samples) return "primary rays inside of geometry";
  if (sums[kMomentPushed] < 0 || sums[kMomentPushed] > samples) return "samples of a moved place";
  if (layout.has_light() && !cached && sums[kMomentLum] < 0) return "luminance";
  if (layout.has_light() && sums[kMomentLum2] < 0) return "squared luminance";
  for (size_t c = 0; c < 3; ++c) {
    if (layout.quantities().direct_apart && sums[layout.direct() + c] < 0) return "direct light";
    if (layout.quantities().all_light && !cached && sums[layout.all_light() + c] < 0) return "all light";
  }
  const std::vector<uint32_t>& responses = layout.quantities().responses;
  for (size_t k = 0; k < responses.size(); ++k) {
    const ResponseInfo& r = response_roster()[responses[k]];
    const double* moments = sums + layout.response(k);
    for (size_t c = 0; c < r.components; ++c)
      if (moments[2 * c + 1] < 0 || (!r.is_signed && moments[2 * c] < 0)) return r.about.data();
  }
  return nullptr;
}

}  // namespace

Status check_result(const Result& result, const WorkUnit* unit, const MomentLayout& layout) {
  const size_t plane_count = layout.planes();
  const UnitResult& r = result.result;
  if ((unit && r.site_count != unit->sites.size()) || r.plane_count != plane_count)
    return fail(ErrorKind::kProtocol,
                text("the result of unit {} has {} sites x {} planes instead of {} x {}", r.unit,
                     r.site_count, r.plane_count, unit ? unit->sites.size() : r.site_count, plane_count));
  for (size_t i = 0; i < r.moments.size(); ++i)
    if (!std::isfinite(r.moments[i]))
      return fail(ErrorKind::kProtocol, text("the result of unit {} holds {} at site {}, plane {}", r.unit,
                                             r.moments[i], i / plane_count, i % plane_count));
  for (uint32_t site = 0; unit && site < r.site_count; ++site)
    if (const char* what = impossible(&r.moments[size_t{site} * plane_count], unit->sample_count,
                                      unit->cache != Digest{}, layout))
      return fail(ErrorKind::kProtocol,
                  text("the result of unit {} cannot be: the sum of its {} at site {} is out of range",
                       r.unit, what, site));
  if (!std::isfinite(r.seconds) || r.seconds < 0)
    return fail(ErrorKind::kProtocol, text("the result of unit {} claims {} seconds", r.unit, r.seconds));
  if (result_digest(r) != result.digest)
    return fail(ErrorKind::kProtocol,
                text("the result of unit {} does not have the digest it states", r.unit));
  return {};
}

}  // namespace kiln
