#include "coordinator/dispatch/result_check.h"

#include <cmath>

#include "common/base/format.h"

namespace kiln {

Status check_result(const Result& result, uint32_t site_count, uint32_t plane_count) {
  const UnitResult& r = result.result;
  if ((site_count && r.site_count != site_count) || r.plane_count != plane_count)
    return fail(ErrorKind::kProtocol,
                text("the result of unit {} has {} sites x {} planes instead of {} x {}", r.unit,
                     r.site_count, r.plane_count, site_count, plane_count));
  for (size_t i = 0; i < r.moments.size(); ++i)
    if (!std::isfinite(r.moments[i]))
      return fail(ErrorKind::kProtocol, text("the result of unit {} holds {} at site {}, plane {}", r.unit,
                                             r.moments[i], i / plane_count, i % plane_count));
  if (!std::isfinite(r.seconds) || r.seconds < 0)
    return fail(ErrorKind::kProtocol, text("the result of unit {} claims {} seconds", r.unit, r.seconds));
  if (result_digest(r) != result.digest)
    return fail(ErrorKind::kProtocol,
                text("the result of unit {} does not have the digest it states", r.unit));
  return {};
}

}  // namespace kiln
