#include "coordinator/dispatch/farm.h"

#include <algorithm>
#include <optional>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/basis/basis.h"
#include "common/wire/limits.h"
#include "coordinator/dispatch/local_workers.h"
#include "coordinator/dispatch/server.h"

namespace kiln {
namespace {

constexpr auto kTick = std::chrono::milliseconds(20);
constexpr uint32_t kTicksPerProgress = 5;

class FarmImpl final : public Farm {
 public:
  FarmImpl(const FarmSettings& settings, const JobSpec& job, const ChunkStore& chunks)
      : settings_(settings), job_(job), timer_(loop_), server_(loop_, settings_, job_, chunks) {}

  Status open();
  ~FarmImpl() override;
  Expected<bool> run_pass(std::vector<WorkUnit> units, int64_t deadline_ms, const Server::OnResult& on_result,
                          const std::function<void(const FarmProgress&)>& on_progress) override;
  const FarmStatistics& statistics() const override { return statistics_; }
  uint16_t port() const override { return server_.port(); }

 private:
  Status check_units(const std::vector<WorkUnit>& units) const;
  void tick();
  void poll_local_workers();
  FarmProgress progress(uint64_t total);

  FarmSettings settings_;
  JobSpec job_;
  EventLoop loop_;
  Timer timer_;
  Server server_;
  std::optional<LocalWorkers> local_;
  FarmStatistics statistics_;
  SteadyClock clock_;
  std::function<void()> on_tick_;
};

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

Status FarmImpl::open() {
  if (settings_.token.empty()) {
    if (!is_loopback(settings_.listen_host))
      return fail(ErrorKind::kUsage,
                  text("listening on {} without a token would let anybody answer units: give one",
                       settings_.listen_host));
    settings_.token = random_hex(32);
  }
  KILN_TRY_STATUS(server_.listen());
  if (settings_.local_workers == 0) return {};
  const bool any = settings_.listen_host == "0.0.0.0" || settings_.listen_host == "::";
  const std::string host = any ? "127.0.0.1" : settings_.listen_host;
  const bool v6 = host.find(':') != std::string::npos;
  KILN_TRY(local_,
           LocalWorkers::start({settings_.worker_program, settings_.local_workers, settings_.local_threads,
                                text("{}{}{}:{}", v6 ? "[" : "", host, v6 ? "]" : "", server_.port()),
                                settings_.token}));
  return {};
}

FarmImpl::~FarmImpl() {
  timer_.cancel();
  server_.dismiss_all("the bake has ended");
  // Their goodbyes get half a second; whoever is stopped or far away must not hold us.
  bool late = false;
  timer_.after(std::chrono::milliseconds(500), [&] { late = true; });
  loop_.run_until([&] { return late || server_.connections() == 0; });
  if (local_) local_->stop();
}

Status FarmImpl::check_units(const std::vector<WorkUnit>& units) const {
  const size_t planes = moment_plane_names(job_.transport.basis).size();
  const size_t most = (kMaxDataBytes - 256) / (planes * sizeof(double));
  for (const WorkUnit& unit : units)
    if (unit.sites.empty() || unit.sites.size() > most)
      return fail(ErrorKind::kUsage,
                  text("a unit has {} texels; 1 to {} fit a message: choose another tile size",
                       unit.sites.size(), most));
  return {};
}

void FarmImpl::poll_local_workers() {
  if (!local_) return;
  std::vector<std::string> events;
  local_->poll(clock_.now_ms(), events);
  for (const std::string& event : events) server_.note(event);
}

void FarmImpl::tick() {
  poll_local_workers();
  server_.tick();
  if (on_tick_) on_tick_();
  timer_.after(kTick, [this] { tick(); });
}

FarmProgress FarmImpl::progress(uint64_t total) {
  return {server_.units_done(), total, server_.statistics().rays, server_.workers_present()};
}

Expected<bool> FarmImpl::run_pass(std::vector<WorkUnit> units, int64_t deadline_ms,
                                  const Server::OnResult& on_result,
                                  const std::function<void(const FarmProgress&)>& on_progress) {
  KILN_TRY_STATUS(check_units(units));
  const uint64_t total = units.size();
  // What piled up while nobody listened (heartbeats, results) is heard before anyone is called silent.
  loop_.run_ready();
  server_.begin_pass(std::move(units), on_result);
  bool nobody_left = false;
  uint32_t ticks = 0;
  on_tick_ = [&] {
    nobody_left = local_ && local_->hopeless() && server_.connections() == 0;
    if (on_progress && ticks++ % kTicksPerProgress == 0) on_progress(progress(total));
  };
  const auto overdue = [&] { return deadline_ms != 0 && clock_.now_ms() >= deadline_ms; };
  tick();
  loop_.run_until(
      [&] { return server_.pass_error() || server_.pass_complete() || nobody_left || overdue(); });
  on_tick_ = nullptr;
  timer_.cancel();
  const bool complete = server_.pass_complete();
  if (on_progress) on_progress(progress(total));
  const uint64_t done = server_.units_done();
  server_.end_pass();
  statistics_ = server_.statistics();
  if (server_.pass_error()) return tl::unexpected<Error>(*server_.pass_error());
  if (complete) return true;
  if (!nobody_left) return false;
  return fail(ErrorKind::kUnavailable,
              text("no worker is left after {} of {} units: the last local one ended with {}", done, total,
                   local_->last_words()));
}

}  // namespace

Expected<std::unique_ptr<Farm>> Farm::start(const FarmSettings& settings, const JobSpec& job,
                                            const ChunkStore& chunks) {
  if (!chunks.find(job.scene) || !chunks.find(job.atlas))
    return fail(ErrorKind::kInternal, "the job names a scene or atlas chunk that is not in the store");
  auto farm = std::make_unique<FarmImpl>(settings, job, chunks);
  KILN_TRY_STATUS(farm->open());
  return std::unique_ptr<Farm>(std::move(farm));
}

}  // namespace kiln
