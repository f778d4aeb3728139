#include "coordinator/dispatch/session.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/wire/limits.h"

namespace kiln {
namespace {

constexpr auto kHandShakePatience = std::chrono::seconds(10);
constexpr size_t kMaxWanted = 1u << 17;  // chunk ids that wait for one worker

}  // namespace

Session::Session(EventLoop& loop, SessionHost& host, std::unique_ptr<Connection> connection)
    : host_(host), connection_(std::move(connection)), hand_shake_(loop), name_(connection_->peer()) {}

void Session::start() {
  hand_shake_.after(kHandShakePatience, [this] { refuse("no Hello came within 10 s"); });
  Connection::Handlers handlers;
  handlers.on_frame = [this](const FrameHeader& h, std::span<const std::byte> p) { on_frame(h, p); };
  handlers.on_room = [this] { serve_chunks(); };
  handlers.on_closed = [this](const std::string& reason) { host_.on_closed(*this, orderly_, reason); };
  connection_->start(std::move(handlers), kChunkWriteBudget);
}

void Session::refuse(const std::string& reason) {
  orderly_ = true;
  connection_->send(Refused{reason});
  connection_->close_after_writes(reason);
}

void Session::goodbye(const std::string& reason) {
  orderly_ = true;
  connection_->send(Goodbye{reason});
  connection_->close_after_writes(reason);
}

void Session::on_frame(const FrameHeader& header, std::span<const std::byte> payload) {
  if (!worker_ && header.type != MessageType::kHello) return refuse("the first message must be a Hello");
  auto message = decode(header, payload);
  if (!message) return refuse(message.error().message);
  if (worker_) host_.on_heard(*this);
  handle(*message);
}

bool Session::of_this_job(uint64_t job) {
  if (job == host_.job().id) return true;
  refuse(text("job {} is not served here", job));
  return false;
}

void Session::handle(Message& message) {
  const auto out_of_place = [this](const auto&) { refuse("a message that only a coordinator sends"); };
  std::visit(
      Overloaded{
          [this](Hello& m) { greet(m); },
          [this](JobClass& m) {
            if (of_this_job(m.job)) class_ = m.numeric_class;
          },
          [this](JobFailed& m) {
            if (of_this_job(m.job)) host_.on_job_failed(*this, m);
          },
          [this](Credits& m) {
            if (!of_this_job(m.job)) return;
            if (class_.empty()) return refuse("Credits came before JobClass");
            host_.on_ready(*this, class_, m.units);
          },
          [this](ChunkRequest& m) { request(m); },
          [this](Result& m) {
            if (of_this_job(m.job)) host_.on_result(*this, std::move(m));
          },
          [this](UnitFailed& m) {
            if (of_this_job(m.job)) host_.on_unit_failed(*this, m);
          },
          [](Heartbeat&) {},
          [this](Drain& m) { host_.on_drain(*this, m); },
          [this](Goodbye& m) {
            orderly_ = true;
            connection_->close_after_writes("goodbye: " + m.reason);
          },
          [this](Refused& m) { connection_->close_after_writes("refused by the worker: " + m.reason); },
          [&](Welcome& m) { out_of_place(m); },
          [&](Job& m) { out_of_place(m); },
          [&](CommitAck& m) { out_of_place(m); },
          [&](ChunkPiece& m) { out_of_place(m); },
          [&](Unit& m) { out_of_place(m); },
          [&](Withdraw& m) { out_of_place(m); },
          [&](JobEnded& m) { out_of_place(m); },
          [&](Pace& m) { out_of_place(m); },
          [&](ClientHello& m) { out_of_place(m); },
          [&](ClientWelcome& m) { out_of_place(m); },
          [&](Request& m) { out_of_place(m); },
          [&](Reply& m) { out_of_place(m); },
      },
      message);
}

void Session::greet(Hello& hello) {
  if (worker_) return refuse("a second Hello");
  const auto admitted = host_.admit(hello, *this);
  if (!admitted) return refuse(admitted.error().message);
  hand_shake_.cancel();
  connection_->accept_data();
  hello_ = std::move(hello);
  hello_.token.clear();
  worker_ = *admitted;
  name_ = text("worker {} ({}, process {})", worker_, hello_.host, hello_.pid);
  connection_->send(host_.welcome(worker_));
  connection_->send(Job{write_job(host_.job())});
}

void Session::request(const ChunkRequest& request) {
  if (wanted_.size() + request.ids.size() > kMaxWanted) return refuse("too many chunks asked for at once");
  for (const Digest& id : request.ids)
    if (!host_.chunk(id)) return refuse(text("chunk {} is not part of the job", id.hex()));
  compress_ = request.compress;
  wanted_.insert(wanted_.end(), request.ids.begin(), request.ids.end());
  serve_chunks();
}

// Keeps at most kChunkWriteBudget queued: the connection calls again when there is room.
void Session::serve_chunks() {
  while (!wanted_.empty() && connection_->queued_bytes() < kChunkWriteBudget) {
    const Bytes& chunk = *host_.chunk(wanted_.front());
    const size_t size = std::min<uint64_t>(kChunkPieceBytes, chunk.size() - sent_);
    const auto first = chunk.begin() + static_cast<ptrdiff_t>(sent_);
    connection_->send(ChunkPiece{wanted_.front(), sent_, chunk.size(),
                                 Bytes(first, first + static_cast<ptrdiff_t>(size)), compress_});
    sent_ += size;
    if (sent_ < chunk.size()) continue;
    wanted_.pop_front();
    sent_ = 0;
  }
}

}  // namespace kiln
