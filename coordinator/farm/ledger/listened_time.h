// Time as the ledger lives it. While nobody calls it (the coordinator is stopped by a debugger, its machine
// sleeps, a disk blocks it), workers may have spoken without being heard: that time has not passed for any of
// its patience. Nor does it go backwards with a clock that does.
#pragma once

#include <cstdint>

namespace kiln {

class ListenedTime {
 public:
  // A longer gap between two events than this was spent elsewhere: ticks come far more often.
  explicit ListenedTime(int64_t longest_gap_ms) : longest_gap_ms_(longest_gap_ms) {}

  // Of an event at this time of the given clock: ms listened since the first one.
  int64_t advance(int64_t clock_ms);
  int64_t at(int64_t clock_ms) const;  // the same, of a question that is no event

 private:
  const int64_t longest_gap_ms_;
  int64_t clock_ms_ = 0, elapsed_ms_ = 0;
  bool begun_ = false;
};

}  // namespace kiln
