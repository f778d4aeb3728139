#include "coordinator/farm/ledger/listened_time.h"

#include "common/base/check.h"

namespace kiln {

int64_t ListenedTime::at(int64_t clock_ms) const {
  const int64_t gap_ms = begun_ ? clock_ms - clock_ms_ : 0;
  return elapsed_ms_ + (gap_ms < 0 || gap_ms > longest_gap_ms_ ? 0 : gap_ms);
}

int64_t ListenedTime::advance(int64_t clock_ms) {
  const int64_t before_ms = elapsed_ms_;
  elapsed_ms_ = at(clock_ms);
  clock_ms_ = clock_ms;
  begun_ = true;
  KILN_CHECK(elapsed_ms_ >= before_ms);
  return elapsed_ms_;
}

}  // namespace kiln
