// Figures that a stage reports about its own work.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"

namespace kiln {

struct StageTime {
  std::string name;
  double seconds = 0;
  double cpu_seconds = 0;  // of all threads of this process
};

// Appends the seconds since its construction to a list when destroyed.
class StageTimer {
 public:
  StageTimer(std::vector<StageTime>& times, std::string name) : times_(times), name_(std::move(name)) {}
  ~StageTimer() { times_.push_back({name_, watch_.seconds(), cpu_.seconds()}); }

 private:
  std::vector<StageTime>& times_;
  std::string name_;
  Stopwatch watch_;
  CpuStopwatch cpu_;
};

// "largest step across a seam before", 0.31, "".
struct Figure {
  std::string name;
  double value = 0;
  std::string unit;
};
using Figures = std::vector<Figure>;

}  // namespace kiln
