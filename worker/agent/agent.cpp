#include "worker/agent/agent.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <random>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/limits.h"
#include "worker/agent/agent_impl.h"

namespace kiln {
namespace {

using std::chrono::milliseconds;

constexpr auto kConnectPatience = milliseconds(10000);
constexpr int64_t kFirstPauseMs = 50, kLongestPauseMs = 5000;
constexpr uint32_t kMinHeartbeatMs = 10, kMaxHeartbeatMs = 60000;
constexpr auto kWatchPeriod = milliseconds(1000);
constexpr uint32_t kBeatsToDeliver =
    2;  // after this, results of jobs that were not sent again are delivered too

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::string best_isa() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) return "avx512";
  if (__builtin_cpu_supports("avx2")) return "avx2";
  if (__builtin_cpu_supports("avx")) return "avx";
  return __builtin_cpu_supports("sse4.2") ? "sse4.2" : "sse2";
}

AgentSettings with_defaults(AgentSettings settings) {
  if (settings.memory_bytes == 0) settings.memory_bytes = default_memory_budget();
  return settings;
}

uint64_t draw_instance() {
  std::random_device device;
  return uint64_t{device()} << 32 | device();
}

}  // namespace

Agent::Agent(const AgentSettings& settings)
    : settings_(with_defaults(settings)),
      retry_(loop_),
      heartbeat_(loop_),
      watch_(loop_),
      drain_limit_(loop_),
      instance_(draw_instance()) {
  if (!settings_.cache_folder.empty()) disk_ = DiskCache::open(settings_.cache_folder, settings_.cache_bytes);
  if (disk_) disk_thread_ = std::make_unique<TaskQueue>();
  pool_ = std::make_unique<BakePool>(settings_.threads, [this](const Unit& unit, auto result) {
    loop_.post([this, unit, result = std::move(result)]() mutable { on_done(unit, std::move(result)); });
  });
}

Status Agent::run() {
  loop_.on_signals({SIGTERM, SIGINT}, [this](int) { drain("told to stop by a signal"); });
  if (settings_.preemption.asks())
    preemption_ = std::make_unique<PreemptionWatch>(settings_.preemption, [this](const std::string& notice) {
      loop_.post([this, notice] { drain(notice); });
    });
  last_contact_ms_ = clock_.now_ms();
  connect();
  watch();
  loop_.run_until([this] { return end_.has_value(); });
  return *end_;
}

void Agent::finish(Status end) {
  if (!end_) end_ = std::move(end);
}

void Agent::connect() {
  if (!settings_.tls.ca.empty()) {
    auto tls = TlsContext::load(settings_.tls);
    // Files that were valid before may be in the middle of being replaced.
    if (!tls && !tls_) return finish(fail(tls.error().kind, tls.error().message));
    if (!tls) return retry(tls.error().message);
    tls_ = *tls;
  }
  connect_to(
      loop_, settings_.host, settings_.port, kConnectPatience,
      [this](Expected<std::unique_ptr<Connection>> connection) { on_connected(std::move(connection)); },
      tls_);
}

void Agent::retry(const std::string& reason) {
  if (end_) return;
  const int64_t alone_ms = clock_.now_ms() - last_contact_ms_;
  if (alone_ms >= settings_.patience_ms)
    return finish(fail(ErrorKind::kUnavailable,
                       text("no coordinator at {}:{} for {} s: {}. Is it running, and is the port open?",
                            settings_.host, settings_.port, alone_ms / 1000, reason)));
  int64_t pause = std::min(kLongestPauseMs, kFirstPauseMs << std::min(failures_++, 10u));
  // Jittered, so that a thousand workers do not reconnect in the same millisecond.
  pause += static_cast<int64_t>(draw_instance() % static_cast<uint64_t>(pause));
  if (failures_ == 1) log_info(text("{}; trying again", reason));
  retry_.after(milliseconds(pause), [this] { connect(); });
}

void Agent::on_connected(Expected<std::unique_ptr<Connection>> connection) {
  if (end_) return;
  if (!connection) return retry(connection.error().message);
  connection_ = std::move(*connection);
  connection_->accept_data();
  Connection::Handlers handlers;
  handlers.on_frame = [this](const FrameHeader& h, std::span<const std::byte> p) { on_frame(h, p); };
  handlers.on_closed = [this](const std::string& reason) { on_closed(reason); };
  handlers.on_room = [this] { pump(); };
  connection_->start(std::move(handlers), kChunkWriteBudget);
  send_hello();
}

void Agent::send_hello() {
  Hello hello;
  hello.version = KILN_VERSION;
  hello.token = settings_.token;
  hello.host = settings_.name.empty() ? host_name() : settings_.name;
  hello.pid = static_cast<uint32_t>(::getpid());
  hello.instance = instance_;
  hello.threads = settings_.threads;
  hello.isa = best_isa();
  hello.engine = settings_.engine;
  connection_->send(hello);
}

void Agent::send(const Message& message) {
  if (welcomed_) connection_->send(message);
}

void Agent::break_connection(const std::string& reason) {
  log_warning(text("the coordinator broke the protocol: {}", reason));
  if (connection_) connection_->close_after_writes(reason);
}

void Agent::on_closed(const std::string& reason) {
  connection_.reset();
  welcomed_ = false;
  heartbeat_.cancel();
  cache_.forget_partial();
  asked_.clear();
  outbox_.clear();
  for (auto& [id, job] : jobs_) job.awaited.clear();
  // A restarted coordinator has not rebuilt their caches yet; it will send the units again when it has.
  for (const Unit& unit : waiting_) taken_.erase({unit.job, unit.unit.id});
  stop_waiting([](const Unit&) { return true; });
  if (leaving_) return finish(*leaving_);
  if (draining_) leave_if_drained();
  retry(text("lost the coordinator: {}", reason));
}

void Agent::on_frame(const FrameHeader& header, std::span<const std::byte> payload) {
  last_contact_ms_ = clock_.now_ms();
  auto message = decode(header, payload);
  peer_minor_ = header.minor;
  if (message) return handle(*message);
  if (header.major != kWireMajor) return finish(fail(ErrorKind::kUsage, message.error().message));
  break_connection(message.error().message);
}

void Agent::handle(Message& message) {
  const auto out_of_place = [this](const auto&) { break_connection("a message that only a worker sends"); };
  std::visit(Overloaded{
                 [this](Welcome& m) { greet(m); },
                 [this](Refused& m) {
                   finish(fail(ErrorKind::kUsage, text("the coordinator at {}:{} refused this worker: {}",
                                                       settings_.host, settings_.port, m.reason)));
                 },
                 [this](Goodbye& m) {
                   log_info(text("the coordinator says goodbye: {}", m.reason));
                   finish({});
                 },
                 [this](Job& m) { start_job(m); },
                 [this](ChunkPiece& m) { on_piece(m); },
                 [this](Unit& m) { take_unit(m); },
                 [this](CommitAck& m) { on_ack(m); },
                 [&](Hello& m) { out_of_place(m); },
                 [&](JobClass& m) { out_of_place(m); },
                 [&](JobFailed& m) { out_of_place(m); },
                 [&](Credits& m) { out_of_place(m); },
                 [&](ChunkRequest& m) { out_of_place(m); },
                 [&](UnitFailed& m) { out_of_place(m); },
                 [&](Heartbeat& m) { out_of_place(m); },
                 [&](Drain& m) { out_of_place(m); },
                 [&](Result& m) { out_of_place(m); },
                 [this](Withdraw& m) { withdraw(m); },
                 [this](JobEnded& m) { end_job(m.job, m.reason); },
                 [this](Pace& m) { set_pace(m.heartbeat_ms); },
                 [&](ClientHello& m) { out_of_place(m); },
                 [&](ClientWelcome& m) { out_of_place(m); },
                 [&](Request& m) { out_of_place(m); },
                 [&](Reply& m) { out_of_place(m); },
             },
             message);
}

void Agent::greet(const Welcome& welcome) {
  failures_ = 0;
  welcomed_ = true;
  ++connection_count_;
  beats_ = 0;
  outbox_.clear();
  undelivered_.clear();
  for (const auto& [id, job] : jobs_) undelivered_.insert(id);
  log_info(text("connected to {}:{} as worker {}", settings_.host, settings_.port, welcome.worker));
  set_pace(welcome.heartbeat_ms);
}

void Agent::set_pace(uint32_t heartbeat_ms) {
  heartbeat_ms_ = std::clamp(heartbeat_ms, kMinHeartbeatMs, kMaxHeartbeatMs);
  if (welcomed_) beat();
}

void Agent::beat() {
  const size_t queued = pool_->queued() + waiting_.size();
  const auto oldest = pool_->oldest();
  const int64_t age_ms = oldest ? clock_.now_ms() - oldest->at_ms : 0;
  send(Heartbeat{static_cast<uint32_t>(taken_.size() - std::min(taken_.size(), queued)),
                 static_cast<uint32_t>(queued), static_cast<uint64_t>(age_ms)});
  if (++beats_ == kBeatsToDeliver)
    for (const uint64_t job : std::set(undelivered_)) deliver_again(job);
  heartbeat_.after(milliseconds(heartbeat_ms_), [this] { beat(); });
}

// Periodic work that does not need a coordinator.
void Agent::watch() {
  if (!settings_.alive_file.empty()) {
    const int fd = ::open(settings_.alive_file.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
    if (fd >= 0) {
      ::futimens(fd, nullptr);
      ::close(fd);
    }
  }
  stop_if_stuck();
  watch_.after(kWatchPeriod, [this] { watch(); });
}

void Agent::drain(const std::string& reason) {
  if (draining_) return;
  draining_ = true;
  Drain message{{}, reason};
  for (const Unit& unit : take_unbegun([](const Unit&) { return true; })) {
    taken_.erase({unit.job, unit.unit.id});
    // Units of an earlier job are returned when the connection ends: Drain names no job.
    if (current_ == unit.job) message.units.push_back(unit.unit.id);
  }
  log_info(text("{}: {} units run on, {} are handed back", reason, taken_.size(), message.units.size()));
  send(message);
  drain_limit_.after(milliseconds(settings_.drain_limit_ms), [this] {
    log_warning(text("{} units did not finish in {} s and are abandoned", taken_.size(),
                     settings_.drain_limit_ms / 1000));
    finish({});
  });
  leave_if_drained();
}

// Keep results until acknowledged; without a coordinator there is nothing to wait for.
void Agent::leave_if_drained() {
  const bool wanted =
      std::any_of(taken_.begin(), taken_.end(), [](const auto& t) { return !t.second.withdrawn; });
  if (!draining_ || end_ || (welcomed_ && (wanted || kept_bytes_ > 0))) return;
  if (!welcomed_) return finish({});
  send(Goodbye{"drained"});
  connection_->close_after_writes("drained");
  welcomed_ = false;
}

Status run_agent(const AgentSettings& settings) {
  auto agent = std::make_unique<Agent>(settings);
  Status end = agent->run();
  // Bake threads cannot be interrupted and still use it; the process is about to exit (agent.h).
  if (!agent->idle()) (void)agent.release();
  return end;
}

}  // namespace kiln
