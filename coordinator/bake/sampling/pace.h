// The speed of a bake: how large units should be, how long is left, when to stop. Wall-clock time
// changes no byte of a result, except in time-limited bakes.
#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace kiln {

class BakePace {
 public:
  explicit BakePace(double seconds) { set_limit(seconds); }
  void set_limit(double seconds);  // time left for passes, from now; infinite: no limit

  // Texels per unit in a pass of that many samples: about a second of one thread's time, less if
  // threads would run out of work at the end. `first`: the value before any speed is known.
  uint32_t unit_texels(double samples, uint32_t first) const;

  // `later`: samples of the passes after it, negative if unknown. `passes`: how many there will be.
  void begin_pass(double samples, double later, double passes);
  void end_pass(uint32_t unit_texels, uint64_t units, double worker_seconds);
  void set_thread_count(uint32_t threads) { threads_ = threads > threads_ ? threads : threads_; }

  uint32_t threads() const { return threads_; }

  double seconds() const { return watch_.seconds(); }
  // Records the time between passes: evaluating one and planning the next.
  void end_barrier() { barrier_ = seconds() - ended_; }
  // At the speed of this pass, `done` (a share) through it, and of the last one, which counts less the more
  // is done; negative: unknown yet.
  double seconds_left(double done) const;
  // Between passes: the time for that many samples in that many passes, at the speed of the last one.
  double seconds_for(double samples, double passes) const;
  double samples_per_second() const { return speed_; }  // in the last pass; 0: unknown
  double limit_left() const;                            // seconds; infinite without a limit
  int64_t deadline_ms() const { return deadline_ms_; }

 private:
  SteadyClock clock_;
  Stopwatch watch_;
  int64_t deadline_ms_ = 0;
  double unit_seconds_ = 0;  // in the last pass
  uint32_t unit_texels_ = 0;
  uint32_t threads_ = 1;
  double began_ = 0, ended_ = 0, samples_ = 0, later_ = 0, passes_ = 0, speed_ = 0, barrier_ = 0;
};

}  // namespace kiln
