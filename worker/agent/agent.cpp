#include "worker/agent/agent.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/limits.h"
#include "worker/agent/agent_impl.h"
#include "worker/agent/record.h"

namespace kiln {
namespace {

using std::chrono::milliseconds;

constexpr int64_t kFirstPauseMs = 50, kLongestPauseMs = 5000;
constexpr uint32_t kMinHeartbeatMs = 10, kMaxHeartbeatMs = 60000;
constexpr auto kWatchPeriod = milliseconds(1000);
constexpr uint32_t kBeatsToDeliver =
    2;  // after this, results of jobs that were not sent again are delivered too

AgentSettings with_defaults(AgentSettings settings) {
  if (settings.memory_bytes == 0) settings.memory_bytes = default_memory_budget();
  return settings;
}

}  // namespace

Agent::Agent(const AgentSettings& settings, AgentEnvironment& environment)
    : settings_(with_defaults(settings)),
      environment_(environment),
      timing_(environment.timing()),
      retry_(timing_.alarm()),
      heartbeat_(timing_.alarm()),
      watch_(timing_.alarm()),
      drain_limit_(timing_.alarm()),
      instance_(environment.draw()) {}

void Agent::start() {
  last_contact_ms_ = timing_.now_ms();
  connect();
  watch();
}

void Agent::finish(Status end) {
  if (!end_) end_ = std::move(end);
}

void Agent::connect() {
  environment_.connect([this](Expected<std::unique_ptr<Link>> link) { on_connected(std::move(link)); });
}

void Agent::retry(const std::string& reason) {
  if (end_) return;
  const int64_t alone_ms = timing_.now_ms() - last_contact_ms_;
  if (alone_ms >= settings_.patience_ms)
    return finish(fail(ErrorKind::kUnavailable,
                       text("no coordinator at {}:{} for {} s: {}. Is it running, and is the port open?",
                            settings_.host, settings_.port, alone_ms / 1000, reason)));
  int64_t pause = std::min(kLongestPauseMs, kFirstPauseMs << std::min(failures_++, 10u));
  // Jittered, so that a thousand workers do not reconnect in the same millisecond.
  pause += static_cast<int64_t>(environment_.draw() % static_cast<uint64_t>(pause));
  if (failures_ == 1) log_info(text("{}; trying again", reason));
  retry_->after(milliseconds(pause), [this] { connect(); });
}

void Agent::on_connected(Expected<std::unique_ptr<Link>> link) {
  if (end_) return;
  if (!link && link.error().kind == ErrorKind::kUsage)
    return finish(fail(ErrorKind::kUsage, link.error().message));
  if (!link) return retry(link.error().message);
  connection_ = std::move(*link);
  connection_->accept_data(kMaxDataBytes);
  Connection::Handlers handlers;
  handlers.on_frame = [this](const FrameHeader& h, std::span<const std::byte> p) { on_frame(h, p); };
  handlers.on_closed = [this](const std::string& reason) { on_closed(reason); };
  handlers.on_room = [this] { pump(); };
  connection_->start(std::move(handlers), kChunkWriteBudget);
  Hello hello = environment_.hello();
  hello.instance = instance_;
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
  heartbeat_->cancel();
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
  last_contact_ms_ = timing_.now_ms();
  auto message = decode(header, payload);
  if (message) return handle(*message);
  if (header.version != kWireVersion) return finish(fail(ErrorKind::kUsage, message.error().message));
  break_connection(message.error().message);
}

void Agent::handle(Message& message) {
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
                 [this](Withdraw& m) { withdraw(m); },
                 [this](JobEnded& m) { end_job(m.job, m.reason); },
                 [this](Pace& m) { set_pace(m.heartbeat_ms); },
                 [this](auto& m) {
                   break_connection(text("a {} message, which coordinators do not send", m.kKind.name));
                 },
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
  const size_t queued = environment_.queued() + waiting_.size();
  const auto oldest = environment_.oldest();
  const int64_t age_ms = oldest ? timing_.now_ms() - oldest->at_ms : 0;
  send(Heartbeat{static_cast<uint32_t>(taken_.size() - std::min(taken_.size(), queued)),
                 static_cast<uint32_t>(queued), static_cast<uint64_t>(age_ms)});
  if (++beats_ == kBeatsToDeliver)
    for (const uint64_t job : std::set(undelivered_)) deliver_again(job);
  heartbeat_->after(milliseconds(heartbeat_ms_), [this] { beat(); });
}

// Periodic work that does not need a coordinator.
void Agent::watch() {
  environment_.touch_alive_file();
  stop_if_stuck();
  watch_->after(kWatchPeriod, [this] { watch(); });
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
  drain_limit_->after(milliseconds(settings_.drain_limit_ms), [this] {
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
  std::unique_ptr<SocketEnvironment> environment;
  if (settings.record.empty()) {
    environment = std::make_unique<SocketEnvironment>(settings);
  } else {
    auto recording = std::make_unique<RecordingEnvironment>(settings);
    KILN_TRY_STATUS(recording->open(settings.record));
    environment = std::move(recording);
  }
  auto agent = std::make_unique<Agent>(settings, *environment);
  environment->watch_for_the_end([&](const std::string& reason) { agent->drain(reason); });
  agent->start();
  environment->loop().run_until([&] { return agent->end().has_value(); });
  Status end = *agent->end();
  // Bake threads cannot be interrupted and still use both; the process is about to exit (agent.h).
  if (!agent->idle()) {
    (void)agent.release();
    (void)environment.release();
  }
  return end;
}

}  // namespace kiln
