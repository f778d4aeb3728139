#include "coordinator/farm/dispatch/farm_job.h"

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/responses/basis.h"
#include "common/wire/limits.h"
#include "coordinator/farm/dispatch/farm_impl.h"

namespace kiln {
namespace {

constexpr int64_t kProgressMs = 100;

}  // namespace

FarmJobImpl::FarmJobImpl(FarmImpl& farm, const JobSpec& spec, std::shared_ptr<JobPort> port)
    : farm_(farm),
      spec_(spec),
      port_(std::move(port)),
      planes_(static_cast<uint32_t>(MomentLayout(spec.transport.basis, spec.transport.quantities).planes())) {
}

FarmJobImpl::~FarmJobImpl() {
  farm_.run([&](Server& server) { server.close_job(spec_.id); });
}

Digest FarmJobImpl::add_chunk(Bytes bytes) {
  const Digest id = sha256(bytes);
  added_.insert(id);
  const auto shared = std::make_shared<const Bytes>(std::move(bytes));
  farm_.run([&](Server& server) { server.add_chunk(spec_.id, id, shared); });
  return id;
}

Status FarmJobImpl::check_units(const std::vector<WorkUnit>& units) const {
  const size_t most = (kMaxDataBytes - 256) / (planes_ * sizeof(double));
  for (const WorkUnit& unit : units) {
    if (unit.sites.empty() || unit.sites.size() > most)
      return fail(ErrorKind::kUsage,
                  text("a unit has {} texels; 1 to {} fit a message: choose another tile size",
                       unit.sites.size(), most));
    if (unit.replicate >= kReplicates)
      return fail(ErrorKind::kInternal, text("unit {} is of replicate {}", unit.id, unit.replicate));
    if (unit.cache != Digest{} && !added_.count(unit.cache))
      return fail(ErrorKind::kInternal,
                  text("unit {} names cache {}, which was not added", unit.id, unit.cache.hex()));
  }
  return {};
}

// A cache has twelve bytes a texel, and every pass adds one.
void FarmJobImpl::keep_named_chunks(const std::vector<WorkUnit>& units) {
  std::set<Digest> named;
  for (const WorkUnit& unit : units) named.insert(unit.cache);
  std::erase_if(added_, [&](const Digest& id) { return !named.count(id); });
  farm_.run([&](Server& server) { server.keep_chunks(spec_.id, added_); });
}

Status FarmJobImpl::merge(const PassUnits& units, const DeliveredUnit& delivered,
                          const PassHandlers& handlers) {
  const WorkUnit* unit = units.find(delivered.unit);
  if (!unit) return {};
  std::shared_ptr<const UnitResult> result = delivered.result;
  if (!result) {
    auto stored = farm_.store().read(spec_.id, delivered.unit, delivered.digest);
    const bool good = stored && (*stored)->site_count == unit->sites.size() &&
                      (*stored)->plane_count == planes_ && result_digest(**stored) == delivered.digest;
    if (!good) {
      const std::string why = stored ? "it is not the result that was settled" : stored.error().message;
      farm_.run([&](Server& server) { server.damaged(spec_.id, delivered.unit, why); });
      return {};  // the job rewinds
    }
    result = *stored;
  }
  KILN_CHECK(result && result->unit == unit->id);
  ++sums_.units;
  sums_.rays += result->rays;
  sums_.nonfinite += result->nonfinite;
  sums_.worker_seconds += result->seconds;
  if (result->nonfinite)
    sums_.events.push_back(
        text("unit {} dropped {} contributions that were not finite, the first at texel {}, sample {}",
             unit->id, result->nonfinite, result->nonfinite_texel, result->nonfinite_sample));
  return handlers.on_result ? handlers.on_result(*unit, *result) : Status{};
}

Expected<PassEnd> FarmJobImpl::run_pass(std::vector<WorkUnit> list, int64_t deadline_ms,
                                        const PassHandlers& handlers) {
  KILN_TRY_STATUS(check_units(list));
  if (const auto error = port_->error()) return tl::unexpected<Error>(*error);
  keep_named_chunks(list);
  const auto units = std::make_shared<const PassUnits>(std::move(list));
  bool rewound = false;
  farm_.run([&](Server& server) {
    rewound = port_->clear();
    if (!rewound) server.begin_pass(spec_.id, units);
  });
  if (rewound) return forget_sums();
  int64_t next_progress = clock_.now_ms();
  const auto report = [&] {
    FarmProgress progress = port_->progress();
    progress.rays = sums_.rays;
    if (handlers.on_progress) handlers.on_progress(progress);
  };
  std::optional<Error> failed;
  std::optional<PassEnd> end;
  while (!end && !failed) {
    const int64_t now = clock_.now_ms();
    if (now >= next_progress) {
      report();
      next_progress = now + kProgressMs;
    }
    int64_t patience = next_progress - now;
    if (deadline_ms != 0) {
      if (now >= deadline_ms) {
        end = PassEnd::kTimeUp;
        break;
      }
      patience = std::min(patience, deadline_ms - now);
    }
    auto event = port_->pop(std::max<int64_t>(1, patience));
    if (!event) {
      failed = port_->error();
      continue;
    }
    if (const auto* delivered = std::get_if<DeliveredUnit>(&*event)) {
      if (const Status s = merge(*units, *delivered, handlers); !s) failed = s.error();
    } else if (const auto* skipped = std::get_if<SkippedUnit>(&*event)) {
      const WorkUnit* unit = units->find(skipped->unit);
      if (unit && handlers.on_skipped) handlers.on_skipped(*unit, skipped->reason);
    } else {
      end = std::get<PassEnded>(*event).end;
    }
  }
  if (failed || *end == PassEnd::kTimeUp) {
    farm_.run([&](Server& server) {
      server.end_pass(spec_.id);
      if (failed) server.fail_job(spec_.id, *failed);
    });
    // Results settled before the deadline count.
    while (!failed && end)
      if (auto event = port_->pop(0)) {
        const auto* delivered = std::get_if<DeliveredUnit>(&*event);
        if (!delivered) {
          if (const auto* ended = std::get_if<PassEnded>(&*event)) end = ended->end;
          continue;
        }
        if (const Status s = merge(*units, *delivered, handlers); !s) failed = s.error();
      } else {
        break;
      }
  }
  report();
  if (failed) return tl::unexpected<Error>(*failed);
  KILN_CHECK(end.has_value());
  // A stored result that could not be read rewinds a pass whose end was told before.
  if (*end != PassEnd::kRewound && port_->clear()) end = PassEnd::kRewound;
  return *end == PassEnd::kRewound ? forget_sums() : *end;
}

PassEnd FarmJobImpl::forget_sums() {
  std::vector<std::string> events = std::move(sums_.events);
  sums_ = {};
  sums_.events = std::move(events);
  return PassEnd::kRewound;
}

FarmStatistics FarmJobImpl::statistics() {
  FarmStatistics all;
  farm_.run([&](Server& server) { all = server.statistics(spec_.id); });
  all.rays = sums_.rays;
  all.units = sums_.units;
  all.nonfinite = sums_.nonfinite;
  all.worker_seconds = sums_.worker_seconds;
  all.events.insert(all.events.end(), sums_.events.begin(), sums_.events.end());
  return all;
}

}  // namespace kiln
