// ledger_rate [--workers N] [--units N] [--quorum N]: time that the ledger alone takes for a unit: grant,
// result, commit and settling, with heartbeats and ticks. No disk, no sockets. Compare builds by alternating
// runs.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>

#include "common/base/clock.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace {

using namespace kiln;

constexpr uint32_t kThreads = 8;
constexpr uint32_t kCredits = kThreads + 2;

struct Farm {
  FarmLedger ledger{[] {
    FarmRules rules;
    rules.lease_ms = 15000;
    return rules;
  }()};
  int64_t now = 0;
  std::deque<Grant> given;
  uint64_t settled = 0;

  // Workers are ready at once, and so is the disk.
  void perform(Actions& out) {
    for (size_t i = 0; i < out.size(); ++i) {
      const Action action = out[i];
      if (const auto* a = std::get_if<Assign>(&action))
        ledger.ready(a->worker, a->job, "class", kCredits, {}, now, out);
      if (const auto* g = std::get_if<Grant>(&action)) given.push_back(*g);
      if (const auto* s = std::get_if<StoreAnswer>(&action))
        ledger.stored(s->job, s->unit, s->ticket, now, out);
      settled += std::holds_alternative<Settle>(action);
    }
    out.clear();
  }
};

void bake(Farm& farm, uint32_t workers, uint64_t units, uint32_t quorum) {
  Actions out;
  for (JobId job = 1; job <= 2; ++job) {
    JobTraits traits;
    traits.user = job == 1 ? "ada" : "ben";
    traits.quorum = quorum;
    farm.ledger.add_job(job, traits);
    std::vector<UnitPlan> plan;
    for (uint64_t unit = 1; unit <= units; ++unit)
      plan.push_back({unit, unit, 1.0 + static_cast<double>(unit % 3)});
    farm.ledger.begin_pass(job, plan, farm.now, out);
    farm.perform(out);
  }
  for (WorkerId worker = 1; worker <= workers; ++worker) {
    const std::string name = "w" + std::to_string(worker);
    farm.ledger.join(worker, {name, name, kThreads, worker}, farm.now, out);
    farm.perform(out);
  }
  uint64_t results = 0;
  while (farm.settled < 2 * units) {
    if (farm.given.empty()) farm.now += 20, farm.ledger.tick(farm.now, out), farm.perform(out);
    if (farm.given.empty()) continue;
    const Grant grant = farm.given.front();
    farm.given.pop_front();
    Digest digest;
    digest.bytes[0] = static_cast<uint8_t>(grant.unit);
    farm.ledger.result(grant.worker, grant.job, grant.unit, digest, farm.now, out);
    farm.perform(out);
    if (++results % workers == 0) farm.now += 20, farm.ledger.tick(farm.now, out), farm.perform(out);
  }
}

}  // namespace

int main(int argc, char** argv) {
  uint64_t workers = 200, units = 20000, quorum = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    const uint64_t value = std::strtoull(argv[i + 1], nullptr, 10);
    if (!std::strcmp(argv[i], "--workers")) workers = value;
    if (!std::strcmp(argv[i], "--units")) units = value;
    if (!std::strcmp(argv[i], "--quorum")) quorum = value;
  }
  if (workers < quorum || units == 0 || quorum == 0) {
    std::fprintf(stderr, "usage: ledger_rate [--workers N] [--units N] [--quorum N]\n");
    return 2;
  }
  Farm farm;
  const Stopwatch watch;
  bake(farm, static_cast<uint32_t>(workers), units, static_cast<uint32_t>(quorum));
  std::printf("%.3f us a unit\n", watch.seconds() * 1e6 / (2.0 * static_cast<double>(units)));
  return 0;
}
