#include "coordinator/cli/progress.h"

#include <unistd.h>

#include <cstdio>

#include "common/base/format.h"

namespace kiln {

std::string duration_text(double seconds) {
  const auto s = static_cast<uint64_t>(seconds + 0.5);
  if (s < 60) return text("{} s", s);
  if (s < 3600) return text("{} min {} s", s / 60, s % 60);
  return text("{} h {} min", s / 3600, s / 60 % 60);
}

ProgressPrinter::ProgressPrinter(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO)) {}

ProgressPrinter::~ProgressPrinter() {
  if (open_line_) std::fputs("\n", stderr);
}

void ProgressPrinter::line(const std::string& s) {
  if (terminal_) {
    std::fprintf(stderr, "\r\033[K%s", s.c_str());
    open_line_ = true;
  } else {
    std::fprintf(stderr, "%s\n", s.c_str());
  }
  std::fflush(stderr);
}

void ProgressPrinter::operator()(const BakeProgress& p) {
  if (quiet_) return;
  const double now = watch_.seconds();
  const bool fresh = p.stage != stage_ || p.pass != pass_;
  // Ten times a second on a terminal, every ten seconds in a log.
  if (!fresh && now - last_ < (terminal_ ? 0.1 : 10.0)) return;
  last_ = now;
  stage_ = p.stage;
  pass_ = p.pass;
  if (p.stage != "bake") {
    line(p.done > 0 ? text("{}  {:.0f} %", p.stage, 100 * p.done) : p.stage + " ...");
    return;
  }
  std::string bar;
  if (terminal_)
    for (int i = 0; i < 24; ++i) bar += i < static_cast<int>(24 * p.done) ? "#" : ".";
  line(text("bake  pass {}  {}{:3.0f} %  {:.2f} M rays/s  {:.1f} % of texels converged  {}", p.pass,
            bar.empty() ? "" : bar + " ", 100 * p.done, p.rays_per_second / 1e6, 100 * p.converged_share,
            p.seconds_left >= 0 ? "about " + duration_text(p.seconds_left) + " left" : ""));
}

}  // namespace kiln
