// A connection between two simulated processes: real frames, in order, each direction with its own delays. It
// can break, and then what was on its way is lost, and either end learns of it in its own time.
#pragma once

#include "common/wire/link.h"
#include "tests/agent_sim/clockwork.h"

namespace kiln::sim {

// What a world sees of a link's traffic; `link` numbers connections.
struct LinkWatch {
  std::function<void(uint64_t link, const Message&)> on_sent, on_delivered;  // at this end
  std::function<void(uint64_t link, const std::string& reason)> on_part;     // this end ends it
};

class SimWire;

class SimLink final : public Link {
 public:
  SimLink(std::shared_ptr<SimWire> wire, int side, ProcessTiming& timing, LinkWatch watch);
  ~SimLink() override;
  void start(Connection::Handlers handlers, size_t budget) override;
  void accept_data(uint32_t) override {}
  void send(const Message& message) override;
  size_t queued_bytes() const override { return queued_; }
  void drop_queued() override {}
  void close_after_writes(std::string reason) override;
  std::string peer() const override { return "sim:" + std::to_string(number()); }
  std::string caller() const override { return "sim"; }
  bool loopback() const override { return true; }
  const PeerIdentity& peer_identity() const override { return nobody_; }

 private:
  friend class SimWire;
  uint64_t number() const;
  void arrive(const Bytes& frame);
  void closed(const std::string& reason);

  const std::shared_ptr<SimWire> wire_;
  const int side_;
  ProcessTiming& timing_;
  const LinkWatch watch_;
  Connection::Handlers handlers_;
  size_t budget_ = 0, queued_ = 0;
  int64_t arrives_ = 0;  // of the last frame sent
  bool started_ = false, ended_ = false;
  const PeerIdentity nobody_;
};

class SimWire : public std::enable_shared_from_this<SimWire> {
 public:
  SimWire(Clockwork& clock, uint64_t number, int64_t slowest_ms)
      : clock_(clock), number_(number), slowest_ms_(slowest_ms) {}
  // Loses what is on its way; each end hears of it within `late_ms`.
  void cut(int64_t late_ms);
  bool broken() const { return broken_; }
  uint64_t number() const { return number_; }
  // Results that the agent sends arrive twice with this probability.
  double twice = 0;
  std::function<void()> on_twice;

 private:
  friend class SimLink;
  void carry(int to, int64_t when, std::function<void(SimLink&)> what);
  Clockwork& clock_;
  const uint64_t number_;
  const int64_t slowest_ms_;
  SimLink* ends_[2] = {};
  bool broken_ = false;
};

}  // namespace kiln::sim
