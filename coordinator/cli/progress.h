// A bar on a terminal, plain lines elsewhere.
#pragma once

#include "common/base/clock.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

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
  Stopwatch watch_;
};

// "2 min 5 s".
std::string duration_text(double seconds);

}  // namespace kiln
