// The workers, and what befalls everybody.
#include "common/base/check.h"
#include "common/base/format.h"
#include "tests/agent_sim/world.h"

namespace kiln::sim {

void World::make_machines() {
  machines_.resize(2 + clock_.draw(3));
  for (size_t i = 0; i < machines_.size(); ++i) {
    Machine& m = machines_[i];
    m.traits.name = text("worker-{}", i);
    m.traits.threads = 1 + static_cast<uint32_t>(clock_.draw(3));
    m.traits.unit_ms = 10 + static_cast<int64_t>(clock_.draw(200));
    if (clock_.chance(0.5)) m.traits.cache = folder_ / text("cache-{}", i);
    m.settings.threads = m.traits.threads;
    m.settings.memory_bytes = uint64_t{1} << 30;
    m.settings.patience_ms = 3600000;
    m.settings.unit_limit_ms = 20000;
    m.settings.drain_limit_ms = 5000;
    if (clock_.chance(0.2)) m.settings.kept_bytes = 4096;
    m.settings.make_baker = [](Scene, Atlas, const TransportSettings& t, unsigned) { return sim_baker(t); };
  }
}

void World::start_agent(size_t i) {
  Machine& m = machines_[i];
  KILN_CHECK(!m.agent);
  SimHost host;
  host.connect = [this, i](auto done) { connect(i, std::move(done)); };
  host.fate = [this, i](const Unit& unit) {
    Machine& here = machines_[i];
    if (jobs_.at(unit.job).poisoned && unit.unit.id == 1) return SimHost::Fate::kFails;
    if (clock_.now() >= faults_end_) return SimHost::Fate::kBakes;
    if (clock_.chance(0.004) && here.hung == 0) {
      ++figures_.hung;
      ++here.hung;
      return SimHost::Fate::kHangs;
    }
    return clock_.chance(0.01) ? SimHost::Fate::kFails : SimHost::Fate::kBakes;
  };
  m.traffic = {};
  m.hung = 0;
  m.environment = std::make_unique<SimEnvironment>(clock_, m.settings, m.traits, next_process_++, host);
  m.agent = std::make_unique<Agent>(m.settings, *m.environment);
  m.environment->process().after_each([this, i] { look_after(i); });
  m.agent->start();
}

// Without a word, as by SIGKILL.
void World::end_agent(size_t i, int64_t back_ms) {
  Machine& m = machines_[i];
  if (!m.agent) return;
  m.agent.reset();
  m.environment.reset();
  clock_.at(clock_.now() + back_ms, [this, i] { start_agent(i); });
}

// Its supervisor starts a process that ended again.
void World::look_after(size_t i) {
  Machine& m = machines_[i];
  if (!m.agent || !m.agent->end()) return;
  const Status& end = *m.agent->end();
  if (!end && end.error().kind == ErrorKind::kUsage &&
      end.error().message.find("has run") == std::string::npos &&
      end.error().message.find("hung") == std::string::npos)
    fail(text("{} is refused: {}", m.traits.name, end.error().message));
  clock_.at(clock_.now(), [this, i, agent = m.agent.get()] {
    if (machines_[i].agent.get() == agent) end_agent(i, 200);
  });
}

void World::connect(size_t i, std::function<void(Expected<std::unique_ptr<Link>>)> done) {
  ProcessTiming& process = machines_[i].environment->process();
  process.later(1 + static_cast<int64_t>(clock_.draw(20)), [this, i, done, &process] {
    if (!coordinator_) return done(kiln::fail(ErrorKind::kUnavailable, "nobody listens"));
    const auto wire =
        std::make_shared<SimWire>(clock_, next_link_++, 1 + static_cast<int64_t>(clock_.draw(40)));
    if (clock_.now() < faults_end_ && clock_.chance(0.3)) wire->twice = 0.1;
    wire->on_twice = [this] { ++figures_.twice; };
    machines_[i].wire = wire;
    auto end = std::make_unique<SimLink>(wire, 0, process, watch(i));
    auto other = std::make_unique<SimLink>(wire, 1, *coordinator_, LinkWatch{});
    server_->accept(std::move(other));
    done(std::move(end));
  });
}

LinkWatch World::watch(size_t i) {
  return {
      [this, i](uint64_t link, const Message& message) { on_sent(i, link, message); },
      [this, i](uint64_t link, const Message& message) { on_delivered(i, link, message); },
      [this, i](uint64_t, const std::string& reason) {
        if (reason != "drained" && reason != "a unit hangs")
          fail(text("{} says that the coordinator broke the protocol: {}", machines_[i].traits.name, reason));
      }};
}

void World::print(size_t i, const char* arrow, const Message& message) const {
  const auto words = [](const auto& m) {
    using M = std::remove_cvref_t<decltype(m)>;
    if constexpr (std::is_same_v<M, Unit>)
      return text("unit {} of job {}, lease {}", m.unit.id, m.job, m.lease);
    else if constexpr (std::is_same_v<M, Result>)
      return text("unit {} of job {}, lease {}", m.result.unit, m.job, m.lease);
    else if constexpr (std::is_same_v<M, CommitAck> || std::is_same_v<M, UnitFailed>)
      return text("unit {} of job {}", m.unit, m.job);
    else
      return std::string();
  };
  if (std::holds_alternative<Heartbeat>(message)) return;
  std::visit(
      [&](const auto& m) {
        std::fprintf(
            stderr, "%s\n",
            text("{:8}  {} {} {} {}", clock_.now(), machines_[i].traits.name, arrow, m.kKind.name, words(m))
                .c_str());
      },
      message);
}

void World::on_sent(size_t i, uint64_t link, const Message& message) {
  if (trace_) print(i, "->", message);
  const auto* result = std::get_if<Result>(&message);
  if (!result) return;
  ++figures_.results;
  Traffic& t = machines_[i].traffic;
  const Key key{result->job, result->result.unit};
  if (!t.sent.emplace(link, key).second)
    fail(text("{} answers unit {} of job {} twice unasked", machines_[i].traits.name, key.second, key.first));
  const auto old = t.kept.find(key);
  if (old != t.kept.end() && old->second.first != link) ++figures_.resent;
  t.kept[key] = {link, result->digest};
}

void World::on_delivered(size_t i, uint64_t link, const Message& message) {
  if (trace_) print(i, "<-", message);
  Traffic& t = machines_[i].traffic;
  if (const auto* welcome = std::get_if<Welcome>(&message)) {
    t.link = link;
    clock_.at(clock_.now() + 4 * welcome->heartbeat_ms, [this, i, link] { expect_resent(i, link); });
  } else if (const auto* unit = std::get_if<Unit>(&message)) {
    t.sent.erase({link, {unit->job, unit->unit.id}});
  } else if (const auto* ack = std::get_if<CommitAck>(&message)) {
    const Key key{ack->job, ack->unit};
    const auto it = t.kept.find(key);
    if (it == t.kept.end() || it->second.second != ack->digest) return;
    t.kept.erase(it);
    acknowledged_.emplace(ack->job, ack->unit, ack->digest);
  } else if (const auto* gone = std::get_if<Withdraw>(&message)) {
    for (const uint64_t unit : gone->units) t.kept.erase({gone->job, unit});
  } else if (const auto* over = std::get_if<JobEnded>(&message)) {
    std::erase_if(t.kept, [&](const auto& entry) { return entry.first.first == over->job; });
  }
}

// What was not acknowledged is delivered again, soon after a new connection, without being asked for.
void World::expect_resent(size_t i, uint64_t link) {
  Machine& m = machines_[i];
  const auto wire = m.wire.lock();
  if (!m.agent || m.traffic.link != link || !wire || wire->number() != link || wire->broken() ||
      m.agent->end())
    return;
  const int64_t late = m.environment->process().stalled_until() + 2500 - clock_.now();
  if (late > 0 && m.environment->process().stalled_until() > 0)
    return clock_.at(clock_.now() + late, [this, i, link] { expect_resent(i, link); });
  for (const auto& [key, kept] : m.traffic.kept)
    if (kept.first != link)
      fail(text("{} does not deliver unit {} of job {} again", m.traits.name, key.second, key.first));
}

void World::make_trouble() {
  if (clock_.now() >= faults_end_) {
    disk_.set_mood(DiskMood::kGood);
    return;
  }
  const size_t i = clock_.draw(machines_.size());
  Machine& m = machines_[i];
  const uint64_t kind = clock_.draw(100);
  if (kind < 15 && m.agent) {
    ++figures_.kills;
    end_agent(i, 50 + static_cast<int64_t>(clock_.draw(1000)));
  } else if (kind < 40) {
    if (const auto wire = m.wire.lock()) {
      ++figures_.cuts;
      wire->cut(1 + static_cast<int64_t>(clock_.draw(3000)));
    }
  } else if (kind < 55 && m.environment) {
    ++figures_.stalls;
    m.environment->process().stall(static_cast<int64_t>(clock_.draw(5000)));
  } else if (kind < 60 && coordinator_) {
    ++figures_.stalls;
    coordinator_->stall(static_cast<int64_t>(clock_.draw(3000)));
  } else if (kind < 70) {
    kill_coordinator();
  } else if (kind < 80 && disk_.mood() == DiskMood::kGood) {
    disk_.set_mood(clock_.chance(0.5) ? DiskMood::kFull : DiskMood::kReadOnly);
    clock_.at(clock_.now() + static_cast<int64_t>(clock_.draw(1500)),
              [this] { disk_.set_mood(DiskMood::kGood); });
  } else if (kind < 85 && rotting_ && std::filesystem::exists(folder_ / "data")) {
    figures_.rotten += SimDisk::rot(folder_ / "data", clock_.draw(~uint64_t{0}));
  } else if (kind < 90 && m.agent && !m.agent->end()) {
    ++figures_.drained;
    m.environment->process().later(0, [agent = m.agent.get()] { agent->drain("told to stop"); });
  }
  clock_.at(clock_.now() + 30 + static_cast<int64_t>(clock_.draw(seed_ % 3 == 0 ? 100 : 500)),
            [this] { make_trouble(); });
}

}  // namespace kiln::sim
