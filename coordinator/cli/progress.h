// A bar on a terminal, plain lines elsewhere.
#pragma once

#include "common/base/clock.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

// The share of a whole bake that is done, by time: it never falls, although the time left is predicted anew
// after every pass.
class WholeShare {
 public:
  // `left`: seconds; negative: unknown, as long as nothing predicts it. Returns the share, negative if
  // unknown.
  double update(double elapsed, double left);

 private:
  double share_ = -1;
};

class ProgressPrinter {
 public:
  explicit ProgressPrinter(bool quiet);
  ~ProgressPrinter();
  void operator()(const BakeProgress& p);

 private:
  void line(const std::string& text);
  bool quiet_, terminal_;
  std::string stage_;
  uint32_t pass_ = 0;
  double last_ = -1;
  bool open_line_ = false;
  WholeShare whole_;
  Stopwatch watch_;
};

// "2 min 5 s".
std::string duration_text(double seconds);

}  // namespace kiln
