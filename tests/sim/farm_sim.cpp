// farm_sim [--first N] [--seeds N] [--workers N] [--jobs N] [--units N] [--trace] [--digest]: simulated
// farms, one a seed. --digest prints a line per seed: equal before and after a change that must not change
// conduct.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "common/base/clock.h"
#include "tests/sim/world.h"

int main(int argc, char** argv) {
  uint64_t first = 1, seeds = 10000;
  kiln::sim::WorldSize size;
  bool trace = false, digest = false;
  for (int i = 1; i < argc; ++i) {
    const auto number = [&] { return i + 1 < argc ? std::strtoull(argv[++i], nullptr, 10) : 0; };
    if (!std::strcmp(argv[i], "--first"))
      first = number();
    else if (!std::strcmp(argv[i], "--seeds"))
      seeds = number();
    else if (!std::strcmp(argv[i], "--workers"))
      size.workers = static_cast<uint32_t>(number());
    else if (!std::strcmp(argv[i], "--jobs"))
      size.jobs = static_cast<uint32_t>(number());
    else if (!std::strcmp(argv[i], "--units"))
      size.units = static_cast<uint32_t>(number());
    else if (!std::strcmp(argv[i], "--trace"))
      trace = true;
    else if (!std::strcmp(argv[i], "--digest"))
      digest = true;
    else {
      std::fprintf(stderr,
                   "usage: farm_sim [--first N] [--seeds N] [--workers N] [--jobs N] [--units N] [--trace] "
                   "[--digest]\n");
      return 2;
    }
  }
  kiln::sim::WorldFigures sum;
  const kiln::Stopwatch watch;
  for (uint64_t seed = first; seed < first + seeds; ++seed) {
    kiln::sim::World world(seed, size);
    world.trace(trace);
    world.digest(digest);
    const std::string broken = world.run();
    if (digest)
      std::printf("seed %llu: %016llx\n", static_cast<unsigned long long>(seed),
                  static_cast<unsigned long long>(world.digest()));
    const auto& f = world.figures();
    sum.events += f.events, sum.grants += f.grants, sum.answers += f.answers, sum.kills += f.kills;
    sum.restarts += f.restarts, sum.lies += f.lies, sum.quarantined += f.quarantined,
        sum.rewinds += f.rewinds;
    sum.refused_writes += f.refused_writes, sum.skipped += f.skipped, sum.simulated_ms += f.simulated_ms;
    sum.rotten += f.rotten, sum.leaps += f.leaps, sum.torn += f.torn, sum.cut_short += f.cut_short;
    if (!broken.empty()) {
      std::printf("seed %llu breaks a promise %s\nreplay: farm_sim --first %llu --seeds 1 --trace\n",
                  static_cast<unsigned long long>(seed), broken.c_str(),
                  static_cast<unsigned long long>(seed));
      return 1;
    }
  }
  const auto n = [](uint64_t v) { return static_cast<unsigned long long>(v); };
  std::printf(
      "%llu worlds kept every promise in %.1f s: %.1f h simulated, %llu events, %llu grants, %llu answers, "
      "%llu workers killed, %llu coordinators killed, %llu lies, %llu quarantined, %llu rewinds, %llu "
      "refused "
      "writes, %llu units skipped, %llu results rotten, %llu leaps of the clock, %llu rows torn, %llu jobs "
      "cut short\n",
      n(seeds), watch.seconds(), static_cast<double>(sum.simulated_ms) / 3.6e6, n(sum.events), n(sum.grants),
      n(sum.answers), n(sum.kills), n(sum.restarts), n(sum.lies), n(sum.quarantined), n(sum.rewinds),
      n(sum.refused_writes), n(sum.skipped), n(sum.rotten), n(sum.leaps), n(sum.torn), n(sum.cut_short));
  return 0;
}
