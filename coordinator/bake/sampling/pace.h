// How fast a bake goes: how large units should be, how long is left, when to stop. Wall-clock time decides
// nothing here that changes a byte, but for a bake whose time is limited.
#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace kiln {

class BakePace {
 public:
  explicit BakePace(double seconds) { set_limit(seconds); }
  void set_limit(double seconds);  // from now that passes may go on; infinite: no limit

  // Texels that units of a pass of so many samples should have: about a second of a thread's time, less where
  // that would leave threads without work at the end. `first`: before anything is known.
  uint32_t unit_texels(double samples, uint32_t first) const;

  // `later`: samples of the passes after it; negative: not known. `passes`: how many they will be.
  void begin_pass(double samples, double later, double passes);
  void end_pass(uint32_t unit_texels, uint64_t units, double worker_seconds);
  void set_thread_count(uint32_t threads) { threads_ = threads > threads_ ? threads : threads_; }

  double seconds() const { return watch_.seconds(); }
  // What came between the end of a pass and now: looking at it and planning the next, as each pass has it.
  void end_barrier() { barrier_ = seconds() - ended_; }
  // At the speed of this pass, of which a share is done; negative: not known yet.
  double seconds_left(double done) const;
  // Between passes: for so many samples in so many passes, at the speed of the last one.
  double seconds_for(double samples, double passes) const;
  double samples_per_second() const { return speed_; }  // of the last pass; 0: not known
  double limit_left() const;                            // seconds; infinite without a limit
  int64_t deadline_ms() const { return deadline_ms_; }

 private:
  SteadyClock clock_;
  Stopwatch watch_;
  int64_t deadline_ms_ = 0;
  double unit_seconds_ = 0;  // of the last pass
  uint32_t unit_texels_ = 0;
  uint32_t threads_ = 1;
  double began_ = 0, ended_ = 0, samples_ = 0, later_ = 0, passes_ = 0, speed_ = 0, barrier_ = 0;
};

}  // namespace kiln
