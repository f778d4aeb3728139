#include "coordinator/farm/dispatch/result_check.h"

#include <cmath>

#include "common/base/format.h"
#include "common/responses/basis.h"

namespace kiln {
namespace {

// Sums that cannot be: of counts beyond the samples, and of quantities that have no negative samples.
const char* impossible(const double* sums, double samples) {
  if (sums[kMomentInside] < 0 || sums[kMomentInside] > samples) return "primary rays inside of geometry";
  if (sums[kMomentPushed] < 0 || sums[kMomentPushed] > samples) return "samples of a moved place";
  if (sums[kMomentLum] < 0) return "luminance";
  if (sums[kMomentLum2] < 0) return "squared luminance";
  return nullptr;
}

}  // namespace

Status check_result(const Result& result, const WorkUnit* unit, uint32_t plane_count) {
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
    if (const char* what = impossible(&r.moments[size_t{site} * plane_count], unit->sample_count))
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
