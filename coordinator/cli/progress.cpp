#include "coordinator/cli/progress.h"

#include <unistd.h>

#include <algorithm>
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

double WholeShare::update(double elapsed, double left) {
  constexpr double kMost = 0.99;  // all of it is done when the command ends
  if (left >= 0 && elapsed + left > 0) share_ = std::max(share_, std::min(kMost, elapsed / (elapsed + left)));
  return share_;
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
  const double share = whole_.update(now, p.seconds_left);
  std::string out = text("bake  pass {}, {:.0f} % of it", p.pass, 100 * p.done);
  if (share >= 0) {
    std::string bar;
    if (terminal_)
      for (int i = 0; i < 24; ++i) bar += i < static_cast<int>(24 * share) ? "#" : ".";
    out = text("bake  {}{:3.0f} %", bar.empty() ? "" : bar + " ", 100 * share);
    if (p.seconds_left >= 0) out += text("  about {} left", duration_text(p.seconds_left));
    out += text("  pass {}", p.pass);
  }
  line(text("{}  {:.2f} M rays/s  {:.1f} % of texels converged", out, p.rays_per_second / 1e6,
            100 * p.converged_share));
}

}  // namespace kiln
