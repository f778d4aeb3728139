// agent_sim [--first N] [--seeds N] [--trace]: simulated farms of real agents, one a seed.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "tests/agent_sim/world.h"

int main(int argc, char** argv) {
  uint64_t first = 1, seeds = 10000;
  bool trace = false;
  for (int i = 1; i < argc; ++i) {
    const bool more = i + 1 < argc;
    if (more && !std::strcmp(argv[i], "--first")) {
      first = std::strtoull(argv[++i], nullptr, 10);
    } else if (more && !std::strcmp(argv[i], "--seeds")) {
      seeds = std::strtoull(argv[++i], nullptr, 10);
    } else if (!std::strcmp(argv[i], "--trace")) {
      trace = true;
    } else {
      std::fprintf(stderr, "usage: agent_sim [--first N] [--seeds N] [--trace]\n");
      return 2;
    }
  }
  kiln::log_setup("agent_sim", trace ? kiln::LogLevel::kInfo : kiln::LogLevel::kOff);
  kiln::sim::WorldFigures sum;
  const kiln::Stopwatch watch;
  for (uint64_t seed = first; seed < first + seeds; ++seed) {
    kiln::sim::World world(seed, kiln::text("/dev/shm/kiln-agent-sim-{}", ::getpid()));
    world.trace(trace);
    const std::string broken = world.run();
    sum += world.figures();
    if (broken.empty()) continue;
    const auto number = static_cast<unsigned long long>(seed);
    std::printf("seed %llu breaks a promise %s\nreplay: agent_sim --first %llu --seeds 1 --trace\n", number,
                broken.c_str(), number);
    return 1;
  }
  std::printf("%llu worlds kept every promise in %.1f s: %s\n", static_cast<unsigned long long>(seeds),
              watch.seconds(), sum.words().c_str());
  return 0;
}
