#include "tests/agent_sim/sim_link.h"

#include "common/base/check.h"

namespace kiln::sim {

SimLink::SimLink(std::shared_ptr<SimWire> wire, int side, ProcessTiming& timing, LinkWatch watch)
    : wire_(std::move(wire)), side_(side), timing_(timing), watch_(std::move(watch)) {
  wire_->ends_[side_] = this;
}

// The process ended or its owner let go: the other end reads the end of the stream after what was sent.
SimLink::~SimLink() {
  wire_->ends_[side_] = nullptr;
  if (!ended_)
    wire_->carry(1 - side_, std::max(arrives_, wire_->clock_.now()) + 1,
                 [](SimLink& other) { other.closed("the peer closed the connection"); });
}

uint64_t SimLink::number() const {
  return wire_->number();
}

void SimLink::start(Connection::Handlers handlers, size_t budget) {
  KILN_CHECK(handlers.on_frame && !started_);
  handlers_ = std::move(handlers);
  budget_ = budget;
  started_ = true;
}

void SimLink::send(const Message& message) {
  if (ended_) return;
  if (watch_.on_sent) watch_.on_sent(number(), message);
  const Bytes frame = encode(message);
  const bool twice = std::holds_alternative<Result>(message) && wire_->clock_.chance(wire_->twice);
  if (twice && wire_->on_twice) wire_->on_twice();
  queued_ += frame.size();
  arrives_ = std::max(
      arrives_, wire_->clock_.now() + 1 +
                    static_cast<int64_t>(wire_->clock_.draw(static_cast<uint64_t>(wire_->slowest_ms_))));
  // Leaves the queue when it arrives, whoever is there to read it.
  wire_->carry(side_, arrives_, [size = frame.size()](SimLink& self) {
    const bool was_full = self.queued_ >= self.budget_;
    self.queued_ -= size;
    if (was_full && self.queued_ < self.budget_ && self.handlers_.on_room) self.handlers_.on_room();
  });
  for (int copy = 0; copy < (twice ? 2 : 1); ++copy)
    wire_->carry(1 - side_, arrives_, [frame](SimLink& other) { other.arrive(frame); });
}

void SimLink::close_after_writes(std::string reason) {
  if (ended_) return;
  if (watch_.on_part) watch_.on_part(number(), reason);
  ended_ = true;
  const int64_t when = std::max(arrives_, wire_->clock_.now()) + 1;
  wire_->carry(1 - side_, when, [](SimLink& other) { other.closed("the peer closed the connection"); });
  wire_->carry(side_, when + 1, [reason](SimLink& self) {
    const Connection::Handlers last = std::exchange(self.handlers_, {});
    if (last.on_closed) last.on_closed(reason);
  });
}

void SimLink::arrive(const Bytes& frame) {
  if (ended_ || !started_) return;
  const auto header = read_frame_header(std::span(frame).first<kFrameHeaderBytes>());
  KILN_CHECK(header);
  const auto payload = std::span(frame).subspan(kFrameHeaderBytes);
  if (watch_.on_delivered)
    if (const auto message = decode(*header, payload)) watch_.on_delivered(number(), *message);
  handlers_.on_frame(*header, payload);
}

void SimLink::closed(const std::string& reason) {
  if (ended_) return;
  ended_ = true;
  const Connection::Handlers last = std::exchange(handlers_, {});
  if (last.on_closed) last.on_closed(reason);
}

void SimWire::carry(int to, int64_t when, std::function<void(SimLink&)> what) {
  if (broken_ || !ends_[to]) return;
  // The end's own process decides when it looks: it may be stalled or dead by then.
  ends_[to]->timing_.later(std::max<int64_t>(0, when - clock_.now()),
                           [wire = shared_from_this(), to, what = std::move(what)] {
                             if (!wire->broken_ && wire->ends_[to]) what(*wire->ends_[to]);
                           });
}

void SimWire::cut(int64_t late_ms) {
  if (broken_) return;
  broken_ = true;
  for (SimLink* end : ends_) {
    if (!end) continue;
    const int to = end->side_;
    end->timing_.later(static_cast<int64_t>(clock_.draw(static_cast<uint64_t>(late_ms))),
                       [wire = shared_from_this(), to] {
                         if (SimLink* still = wire->ends_[to]) still->closed("the connection broke");
                       });
  }
}

}  // namespace kiln::sim
