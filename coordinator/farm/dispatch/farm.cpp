#include "coordinator/farm/dispatch/farm.h"

#include <future>

#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/base/loopback.h"
#include "coordinator/farm/dispatch/farm_impl.h"
#include "coordinator/farm/dispatch/farm_job.h"

namespace kiln {
namespace {

constexpr auto kTick = std::chrono::milliseconds(20);

}  // namespace

FarmImpl::FarmImpl(const FarmSettings& settings, std::shared_ptr<ResultStore> store)
    : settings_(settings), store_(std::move(store)) {
  settings_.rules.owners_known = settings_.tls || !settings_.owner_tokens.empty();
  const bool revocable = settings_.rules.audit_first > 0;
  if (!store_) store_ = std::make_shared<MemoryResultStore>(revocable);
}

Status FarmImpl::open() {
  if (!is_loopback(settings_.listen_host) && !settings_.tls && !settings_.plain_is_fine)
    return fail(
        ErrorKind::kUsage,
        text(
            "listening on {} without TLS would send tokens and scenes in the clear: give --ca, --certificate "
            "and --key (kiln cert makes them), or say --insecure-plain if the network is trusted",
            settings_.listen_host));
  if (settings_.token.empty() && !settings_.tls) {
    if (!is_loopback(settings_.listen_host))
      return fail(ErrorKind::kUsage,
                  text("listening on {} without a token would let anybody answer units: give one",
                       settings_.listen_host));
    settings_.token = random_hex(32);
  }
  std::promise<Status> opened;
  thread_ = std::jthread([this, &opened] {
    // Local workers are children of this thread: it lives as long as the farm, and they die with it.
    const Status status = open_on_loop();
    const bool good = status.has_value();
    opened.set_value(status);
    if (good) {
      tick();
      loop_.run_until([this] { return stop_; });
      close_on_loop();
    } else {
      local_.reset();
      server_.reset();
      timer_.reset();
    }
  });
  return opened.get_future().get();
}

Status FarmImpl::open_on_loop() {
  timer_.emplace(loop_);
  server_.emplace(*timing_, settings_, *store_);
  KILN_TRY_STATUS(server_->listen(loop_));
  port_ = server_->port();
  if (settings_.local_workers == 0) return {};
  const bool any = settings_.listen_host == "0.0.0.0" || settings_.listen_host == "::";
  const std::string host = any ? "127.0.0.1" : settings_.listen_host;
  const bool v6 = host.find(':') != std::string::npos;
  KILN_TRY(local_, LocalWorkers::start(
                       {settings_.worker_program, settings_.local_workers, settings_.local_threads,
                        text("{}{}{}:{}", v6 ? "[" : "", host, v6 ? "]" : "", port_), settings_.token}));
  return {};
}

void FarmImpl::close_on_loop() {
  timer_->cancel();
  // Goodbye ends a worker. Workers of a queue must wait for the next coordinator instead: their connections
  // just close, and they keep unacknowledged results.
  if (!settings_.comes_back) server_->dismiss_all("the coordinator ends");
  // Wait half a second for goodbyes to be sent; stopped or slow peers must not delay us.
  bool late = false;
  timer_->after(std::chrono::milliseconds(500), [&] { late = true; });
  if (!settings_.comes_back) loop_.run_until([&] { return late || server_->connections() == 0; });
  if (local_) local_->stop();
  server_.reset();
  timer_.reset();
}

FarmImpl::~FarmImpl() {
  if (!thread_.joinable()) return;
  loop_.post([this] { stop_ = true; });
  thread_.join();
}

void FarmImpl::tick() {
  if (local_) {
    std::vector<std::string> events;
    local_->poll(clock_.now_ms(), events);
    for (const std::string& event : events) server_->note(0, event);
    if (local_->hopeless() && server_->connections() == 0)
      server_->fail_all(
          Error{ErrorKind::kUnavailable,
                text("no worker is left: the last local one ended with {}", local_->last_words())});
  }
  server_->tick();
  timer_->after(kTick, [this] { tick(); });
}

void FarmImpl::run(const std::function<void(Server&)>& work) {
  std::promise<void> done;
  loop_.post([&] {
    work(*server_);
    done.set_value();
  });
  done.get_future().get();
}

Expected<std::unique_ptr<FarmJob>> FarmImpl::open_job(const FarmJobSpec& job) {
  if (!job.chunks || !job.chunks->find(job.spec.scene) || !job.chunks->find(job.spec.atlas))
    return fail(ErrorKind::kInternal, "the job names a scene or atlas chunk that is not in the store");
  auto port = std::make_shared<JobPort>(store_->durable());
  Status opened;
  run([&](Server& server) { opened = server.open_job(job, port); });
  if (!opened) return tl::unexpected<Error>(opened.error());
  return std::make_unique<FarmJobImpl>(*this, job.spec, port);
}

void FarmImpl::change_job(JobId job, int32_t priority, bool paused) {
  run([&](Server& server) { server.change_job(job, priority, paused); });
}
void FarmImpl::stop_job(JobId job, const Error& why) {
  run([&](Server& server) { server.fail_job(job, why); });
}
void FarmImpl::hold(bool on, const std::string& reason) {
  run([&](Server& server) { server.hold(on, reason); });
}
void FarmImpl::restore_trust(const std::string& identity, uint64_t agreed,
                             const std::string& quarantined_for) {
  run([&](Server& server) { server.ledger().restore_trust(identity, agreed, quarantined_for); });
}
FarmStatus FarmImpl::status() {
  FarmStatus status;
  run([&](Server& server) { status = server.status(); });
  return status;
}
std::vector<std::string> FarmImpl::why_job(JobId job) {
  std::vector<std::string> lines;
  run([&](Server& server) { lines = server.ledger().why_job(job, clock_.now_ms()); });
  return lines;
}
std::vector<std::string> FarmImpl::why_unit(JobId job, uint64_t unit) {
  std::vector<std::string> lines;
  run([&](Server& server) { lines = server.ledger().why_unit(job, unit, clock_.now_ms()); });
  return lines;
}
std::vector<std::string> FarmImpl::why_worker(const std::string& number_or_name) {
  std::vector<std::string> lines;
  run([&](Server& server) { lines = server.why_worker(number_or_name); });
  return lines;
}

Expected<std::unique_ptr<Farm>> Farm::start(const FarmSettings& settings,
                                            std::shared_ptr<ResultStore> store) {
  auto farm = std::make_unique<FarmImpl>(settings, std::move(store));
  KILN_TRY_STATUS(farm->open());
  return std::unique_ptr<Farm>(std::move(farm));
}

}  // namespace kiln
