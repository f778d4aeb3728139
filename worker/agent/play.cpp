#include "worker/agent/play.h"

#include <algorithm>
#include <map>
#include <set>

#include "common/base/files.h"
#include "common/base/format.h"
#include "worker/agent/agent_impl.h"
#include "worker/agent/recording.h"
#include "worker/agent/socket_environment.h"

namespace kiln {
namespace {

constexpr auto kCheckEvery = std::chrono::milliseconds(500);
constexpr int kIdleChecks = 20;  // an idle agent that owes an answer for so long will not give it

class Player;

class PlayLink final : public Link {
 public:
  explicit PlayLink(Player& player) : player_(player) {}
  ~PlayLink() override;
  void start(Connection::Handlers handlers, size_t) override;
  void accept_data(uint32_t) override {}
  void send(const Message& message) override;
  size_t queued_bytes() const override { return 0; }
  void drop_queued() override {}
  void close_after_writes(std::string reason) override;
  std::string peer() const override { return "the recording"; }
  std::string caller() const override { return "the recording"; }
  bool loopback() const override { return true; }
  const PeerIdentity& peer_identity() const override { return nobody_; }
  const Connection::Handlers& handlers() const { return handlers_; }
  void closed(const std::string& reason) {
    const Connection::Handlers last = std::exchange(handlers_, {});
    if (last.on_closed) last.on_closed(reason);
  }

 private:
  Player& player_;
  Connection::Handlers handlers_;
  const PeerIdentity nobody_;
};

// Stands between the recording's events and the agent. An event waits for what the agent said before it then:
// answers, requests for chunks, the first credits of a job.
class Player final : public SocketEnvironment {
 public:
  Player(const AgentSettings& settings, Recording recording)
      : SocketEnvironment(settings), recording_(std::move(recording)), check_(timing().alarm()) {}

  void connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) override {
    timing().post([this, done] {
      while (!over() && event().kind != Recorded::kOpened) pass_over();
      if (over()) return;
      ++next_;
      ++connections_;
      asked_.clear();
      ready_.clear();
      auto link = std::make_unique<PlayLink>(*this);
      link_ = link.get();
      done(std::move(link));
      go_on();
    });
  }
  bool over() const { return next_ == recording_.events.size(); }
  // Looks now and then whether the agent still owes what the next event waits for.
  void watch(const Agent& agent) {
    check_->after(kCheckEvery, [this, &agent] {
      idle_ = agent.idle() && next_ == seen_ ? idle_ + 1 : 0;
      seen_ = next_;
      if (idle_ >= kIdleChecks && !over()) {
        idle_ = 0;
        pass_over();
        go_on();
      }
      watch(agent);
    });
  }
  void gone(PlayLink& link) {
    if (link_ == &link) link_ = nullptr;
  }
  void said(const Message& message);
  void parted(PlayLink& link, const std::string& reason) {
    timing().post([this, &link, reason] {
      if (link_ == &link) link.closed(reason);
    });
  }
  void go_on() {
    if (!std::exchange(posted_, true))
      timing().post([this] {
        posted_ = false;
        step();
      });
  }
  PlayOutcome outcome() const;

 private:
  using Key = std::tuple<uint64_t, uint64_t, uint64_t>;  // job, unit, shape
  struct Answers {
    std::map<Key, Digest> results;
    std::set<std::pair<uint64_t, uint64_t>> failed, answered;  // job, unit; answered: in either way
    std::map<uint64_t, std::string> classes;
    std::set<uint64_t> failed_jobs;
  };
  const RecordedEvent& event() const { return recording_.events[next_]; }
  static void take(Answers& answers, const Message& message);
  bool waits(const Message& sent) const;
  void pass_over();
  void step();

  const Recording recording_;
  const std::unique_ptr<Alarm> check_;
  PlayLink* link_ = nullptr;
  size_t next_ = 0, seen_ = 0, connections_ = 0, told_ = 0, passed_over_ = 0;
  int idle_ = 0;
  bool posted_ = false;
  std::set<Digest> asked_;    // on this connection
  std::set<uint64_t> ready_;  // jobs with credits on this connection
  Answers then_, now_;
};

PlayLink::~PlayLink() {
  player_.gone(*this);
}
void PlayLink::start(Connection::Handlers handlers, size_t) {
  handlers_ = std::move(handlers);
}
void PlayLink::send(const Message& message) {
  player_.said(message);
}
void PlayLink::close_after_writes(std::string reason) {
  player_.parted(*this, reason);
}

void Player::take(Answers& answers, const Message& message) {
  if (const auto* r = std::get_if<Result>(&message)) {
    answers.results[{r->job, r->result.unit, r->shape}] = result_digest(r->result);
    answers.answered.insert({r->job, r->result.unit});
  } else if (const auto* f = std::get_if<UnitFailed>(&message)) {
    answers.failed.insert({f->job, f->unit});
    answers.answered.insert({f->job, f->unit});
  } else if (const auto* c = std::get_if<JobClass>(&message)) {
    answers.classes[c->job] = c->numeric_class;
  } else if (const auto* j = std::get_if<JobFailed>(&message)) {
    answers.failed_jobs.insert(j->job);
  }
}

void Player::said(const Message& message) {
  take(now_, message);
  if (const auto* request = std::get_if<ChunkRequest>(&message))
    asked_.insert(request->ids.begin(), request->ids.end());
  if (const auto* credits = std::get_if<Credits>(&message)) ready_.insert(credits->job);
  go_on();
}

bool Player::waits(const Message& sent) const {
  if (const auto* r = std::get_if<Result>(&sent)) {
    return !now_.results.count({r->job, r->result.unit, r->shape}) &&
           !now_.failed.count({r->job, r->result.unit});
  }
  if (const auto* f = std::get_if<UnitFailed>(&sent)) return !now_.answered.count({f->job, f->unit});
  if (const auto* c = std::get_if<JobClass>(&sent))
    return !now_.classes.count(c->job) && !now_.failed_jobs.count(c->job);
  if (const auto* j = std::get_if<JobFailed>(&sent))
    return !now_.failed_jobs.count(j->job) && !ready_.count(j->job);
  if (const auto* credits = std::get_if<Credits>(&sent))
    return !ready_.count(credits->job) && !now_.failed_jobs.count(credits->job);
  if (const auto* request = std::get_if<ChunkRequest>(&sent))
    return !std::all_of(request->ids.begin(), request->ids.end(),
                        [&](const Digest& id) { return asked_.count(id) > 0; });
  return false;
}

// The agent does nothing and will not say this again.
void Player::pass_over() {
  if (event().kind == Recorded::kSent) take(then_, *message_of(event()));
  ++passed_over_;
  ++next_;
}

void Player::step() {
  if (over() || !link_ || !link_->handlers().on_frame) return;
  const RecordedEvent& e = event();
  if (e.kind == Recorded::kOpened) return;  // waits for the agent to connect
  if (e.kind == Recorded::kSent) {
    const Message sent = *message_of(e);
    if (waits(sent)) return;
    take(then_, sent);
  }
  ++next_;
  go_on();
  if (e.kind == Recorded::kClosed)
    return link_->closed(std::string(reinterpret_cast<const char*>(e.content.data()), e.content.size()));
  if (e.kind != Recorded::kReceived) return;
  ++told_;
  const std::span<const std::byte> frame(e.content);
  const auto on_frame = link_->handlers().on_frame;
  on_frame(*read_frame_header(frame.first<kFrameHeaderBytes>()), frame.subspan(kFrameHeaderBytes));
}

PlayOutcome Player::outcome() const {
  size_t same = 0, differ = 0, missing = 0;
  std::string lines;
  for (const auto& [key, digest] : then_.results) {
    const auto& [job, unit, shape] = key;
    const auto it = now_.results.find(key);
    if (it == now_.results.end()) {
      ++missing;
      lines += text("unit {} of job {}: no result now, then {}\n", unit, job, digest.hex());
    } else if (it->second != digest) {
      ++differ;
      lines += text("unit {} of job {}: digest {}, then {}\n", unit, job, it->second.hex(), digest.hex());
    } else {
      ++same;
    }
  }
  for (const auto& [job, unit] : then_.failed) {
    const bool again = now_.failed.count({job, unit}) > 0;
    ++(again ? same : differ);
    if (!again) lines += text("unit {} of job {}: it failed then and does not now\n", unit, job);
  }
  for (const uint64_t job : then_.failed_jobs) {
    const bool again = now_.failed_jobs.count(job) > 0;
    ++(again ? same : differ);
    if (!again) lines += text("job {}: its scene could not be made ready then and can now\n", job);
  }
  for (const auto& [job, name] : then_.classes)
    if (const auto it = now_.classes.find(job); it != now_.classes.end() && it->second != name)
      lines += text("job {}: this machine's numeric class is {}, then {}: digests may differ for that\n", job,
                    it->second, name);
  const std::string rest =
      over() ? "" : text("; {} events were not reached", recording_.events.size() - next_);
  lines +=
      text("played {} messages of {} connections{}{}: {} answers are the same, {} differ, {} are missing\n",
           told_, connections_, rest, recording_.cut ? " (the recording ends in the middle of a record)" : "",
           same, differ, missing);
  return {differ + missing == 0, lines};
}

}  // namespace

Expected<PlayOutcome> run_play(const std::string& file, AgentSettings settings) {
  KILN_TRY(const Bytes bytes, read_file(file, kMaxRecordingBytes));
  auto recording = read_recording(bytes);
  if (!recording) return fail(recording.error().kind, text("{}: {}", file, recording.error().message));
  settings.cache_folder.clear();
  settings.alive_file.clear();
  auto player = std::make_unique<Player>(settings, std::move(*recording));
  auto agent = std::make_unique<Agent>(settings, *player);
  player->watch(*agent);
  agent->start();
  player->loop().run_until([&] { return agent->end().has_value() || player->over(); });
  PlayOutcome outcome = player->outcome();
  if (!agent->idle()) {  // bake threads still use both; the process is about to exit
    (void)agent.release();
    (void)player.release();
  }
  return outcome;
}

}  // namespace kiln
