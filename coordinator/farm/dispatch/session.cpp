#include "coordinator/farm/dispatch/session.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/release.h"
#include "common/wire/limits.h"

namespace kiln {
namespace {

constexpr auto kHandShakePatience = std::chrono::seconds(10);
constexpr size_t kMaxWanted = 1u << 17;  // chunk ids queued for one worker
constexpr size_t kMaxJobClasses = 1u << 12;

}  // namespace

Session::Session(Timing& timing, SessionHost& host, std::unique_ptr<Link> link)
    : host_(host),
      connection_(std::move(link)),
      patience_(timing.alarm()),
      peer_(connection_->peer()),
      name_(peer_) {}

void Session::start() {
  patience_->after(kHandShakePatience, [this] { refuse("no Hello came within 10 s"); });
  Connection::Handlers handlers;
  handlers.on_frame = [this](const FrameHeader& h, std::span<const std::byte> p) { on_frame(h, p); };
  handlers.on_room = [this] {
    if (!host_.cut_off(*this)) talk_ ? talk_->on_room() : serve_chunks();
  };
  handlers.on_closed = [this](const std::string& reason) {
    talk_.reset();
    host_.on_closed(*this, orderly_, reason);
  };
  connection_->start(std::move(handlers), kChunkWriteBudget);
}

void Session::send(const Message& message) {
  if (host_.cut_off(*this)) return;
  connection_->send(message);
}

void Session::refuse(const std::string& reason) {
  orderly_ = true;
  connection_->send(Refused{reason});
  connection_->close_after_writes(reason);
}

void Session::cut(const std::string& reason) {
  cut_ = true;
  connection_->drop_queued();
  refuse(reason);
}

void Session::goodbye(const std::string& reason) {
  orderly_ = true;
  connection_->send(Goodbye{reason});
  connection_->close_after_writes(reason);
}

void Session::on_frame(const FrameHeader& header, std::span<const std::byte> payload) {
  if (host_.cut_off(*this)) return;
  const bool known = worker_ || talk_;
  if (!known && header.type != Hello::kKind.type && header.type != ClientHello::kKind.type)
    return refuse("the first message must be a Hello");
  auto message = decode(header, payload);
  if (!message) return refuse(message.error().message);
  if (talk_) {
    expect_client();
    return handle_client(*message);
  }
  if (worker_) host_.on_heard(*this);
  handle(*message);
}

// A client that neither speaks nor is being sent anything gives its place to others. Workers are watched by
// the ledger.
void Session::expect_client() {
  patience_->after(kClientPatience, [this] {
    if (connection_->queued_bytes() > 0) return expect_client();  // a slow reader has a deadline of its own
    refuse(text("nothing was asked for {} minutes: connect again", kClientPatience.count() / 60'000));
  });
}

void Session::handle_client(Message& message) {
  if (auto* request = std::get_if<Request>(&message)) return talk_->on_request(std::move(*request));
  if (auto* piece = std::get_if<ChunkPiece>(&message)) return talk_->on_piece(std::move(*piece));
  if (auto* wanted = std::get_if<ChunkRequest>(&message)) {
    if (const Status s = talk_->on_chunk_request(std::move(*wanted)); !s) refuse(s.error().message);
    return;
  }
  if (const auto* bye = std::get_if<Goodbye>(&message)) {
    orderly_ = true;
    return connection_->close_after_writes("goodbye: " + bye->reason);
  }
  refuse("a message that clients do not send");
}

void Session::handle(Message& message) {
  std::visit(
      Overloaded{
          [this](Hello& m) { greet(m); },
          [this](ClientHello& m) { greet_client(m); },
          [this](JobClass& m) {
            if (classes_.size() >= kMaxJobClasses) classes_.clear();
            classes_[m.job] = m.numeric_class;
            host_.on_class(*this, m);
          },
          [this](JobFailed& m) { host_.on_job_failed(*this, m); },
          [this](Credits& m) {
            const auto its_class = classes_.find(m.job);
            if (its_class == classes_.end()) return refuse("Credits came before JobClass");
            host_.on_ready(*this, its_class->second, m);
          },
          [this](ChunkRequest& m) { request(m); },
          [this](Result& m) { host_.on_result(*this, std::move(m)); },
          [this](UnitFailed& m) { host_.on_unit_failed(*this, m); },
          [](Heartbeat&) {},
          [this](Drain& m) { host_.on_drain(*this, m); },
          [this](Goodbye& m) {
            orderly_ = true;
            connection_->close_after_writes("goodbye: " + m.reason);
          },
          [this](Refused& m) { connection_->close_after_writes("refused by the worker: " + m.reason); },
          [this](auto& m) { refuse(text("a {} message, which workers do not send", m.kKind.name)); },
      },
      message);
}

// A certificate's name is proven; what the program calls its machine stands beside it.
std::string Session::known_as(const std::string& host) const {
  const std::string& proven = identity().name;
  return proven.empty() || proven == host ? host : text("{}, host {}", proven, host);
}

void Session::greet(Hello& hello) {
  if (worker_) return refuse("a second Hello");
  KILN_CHECK(!talk_);
  const auto admitted = host_.admit(hello, *this);
  if (!admitted) return refuse(admitted.error().message);
  patience_->cancel();
  connection_->accept_data(kMaxDataBytes);
  hello_ = std::move(hello);
  hello_.token.clear();
  worker_ = *admitted;
  name_ = text("worker {} ({}, process {})", worker_, known_as(hello_.host), hello_.pid);
  connection_->send(host_.welcome(worker_));
  host_.on_admitted(*this);
}

void Session::greet_client(ClientHello& hello) {
  if (worker_) return refuse("a second Hello");
  auto talk = host_.admit_client(hello, *this);
  if (!talk) return refuse(talk.error().message);
  talk_ = std::move(*talk);
  KILN_CHECK(talk_ && !worker_);
  expect_client();
  connection_->accept_data(talk_->max_message_bytes());
  name_ = text("{} at {}", identity().name.empty() ? hello.user : identity().name, peer_);
  connection_->send(ClientWelcome{release_number(), talk_->role()});
}

void Session::request(const ChunkRequest& request) {
  if (wanted_.size() + request.ids.size() > kMaxWanted) return refuse("too many chunks asked for at once");
  // A chunk of a job that has ended meanwhile: the worker is notified separately.
  for (const Digest& id : request.ids)
    if (host_.chunk(id)) wanted_.push_back(id);
  compress_ = request.compress;
  serve_chunks();
}

// Keeps at most kChunkWriteBudget queued: the connection calls again when there is room.
void Session::serve_chunks() {
  while (!wanted_.empty() && connection_->queued_bytes() < kChunkWriteBudget) {
    const Bytes* chunk = host_.chunk(wanted_.front());
    if (!chunk) {
      wanted_.pop_front();
      sent_ = 0;
      continue;
    }
    KILN_CHECK(sent_ <= chunk->size());
    const size_t size = std::min<uint64_t>(kChunkPieceBytes, chunk->size() - sent_);
    const auto first = chunk->begin() + static_cast<ptrdiff_t>(sent_);
    connection_->send(ChunkPiece{wanted_.front(), sent_, chunk->size(),
                                 Bytes(first, first + static_cast<ptrdiff_t>(size)), compress_});
    sent_ += size;
    if (sent_ < chunk->size()) continue;
    wanted_.pop_front();
    sent_ = 0;
  }
}

}  // namespace kiln
