#include "coordinator/farm/client/link.h"

#include <unistd.h>

#include "common/base/format.h"
#include "common/base/release.h"
#include "common/wire/limits.h"
#include "common/wire/tls.h"

namespace kiln {
namespace {

constexpr auto kConnectPatience = std::chrono::seconds(10);

std::string host_name() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

}  // namespace

Expected<std::unique_ptr<ClientConnection>> ClientConnection::open(const ClientOptions& options) {
  KILN_TRY(const auto address, parse_address(options.server));
  std::shared_ptr<const TlsContext> tls;
  if (options.join) {
    KILN_TRY(tls, TlsContext::for_enrolment(*options.join));
  } else if (!options.ca.empty()) {
    KILN_TRY(tls, TlsContext::load({options.ca, options.certificate, options.key}));
  }
  std::unique_ptr<ClientConnection> link(new ClientConnection());
  std::optional<Expected<std::unique_ptr<Connection>>> made;
  connect_to(
      link->loop_, address.first, address.second, kConnectPatience,
      [&](Expected<std::unique_ptr<Connection>> connection) { made = std::move(connection); }, tls);
  link->loop_.run_until([&] { return made.has_value(); });
  if (!*made) return tl::unexpected<Error>(made->error());
  link->connection_ = std::move(**made);
  Connection::Handlers handlers;
  handlers.on_frame = [raw = link.get()](const FrameHeader& h, std::span<const std::byte> p) {
    raw->on_frame(h, p);
  };
  handlers.on_room = [] {};
  handlers.on_closed = [raw = link.get(), options](const std::string& reason) {
    if (!raw->lost_)
      raw->lost_ =
          Error{ErrorKind::kUnavailable, text("lost the coordinator at {}: {}", options.server, reason)};
  };
  link->connection_->start(std::move(handlers), kChunkWriteBudget);
  link->connection_->accept_data();
  link->send(ClientHello{release_number(), options.token, options.user, host_name()});
  KILN_TRY_STATUS(link->run(kConnectPatience, [&] { return !link->role_.empty(); }));
  return link;
}

void ClientConnection::on_frame(const FrameHeader& header, std::span<const std::byte> payload) {
  auto message = decode(header, payload);
  if (!message) {
    lost_ = message.error();
    return;
  }
  if (const auto* welcome = std::get_if<ClientWelcome>(&*message)) {
    role_ = welcome->role.empty() ? "none" : welcome->role;
  } else if (const auto* refused = std::get_if<Refused>(&*message)) {
    lost_ = Error{ErrorKind::kUsage, text("the coordinator refused: {}", refused->reason)};
  } else if (std::holds_alternative<Reply>(*message) || std::holds_alternative<ChunkPiece>(*message)) {
    arrived_.push_back(std::move(*message));
  }
}

Status ClientConnection::run(std::chrono::milliseconds patience, const std::function<bool()>& done) {
  bool late = false;
  timer_.after(patience, [&] { late = true; });
  loop_.run_until([&] { return late || lost_ || done(); });
  timer_.cancel();
  if (done()) return {};
  if (lost_) return tl::unexpected<Error>(*lost_);
  return fail(ErrorKind::kUnavailable,
              text("the coordinator did not answer for {} s", patience.count() / 1000));
}

Expected<Message> ClientConnection::next(std::chrono::milliseconds patience) {
  KILN_TRY_STATUS(run(patience, [this] { return !arrived_.empty(); }));
  Message message = std::move(arrived_.front());
  arrived_.pop_front();
  return message;
}

Status ClientConnection::wait_for_room(size_t bytes, std::chrono::milliseconds patience) {
  return run(patience, [this, bytes] { return connection_->queued_bytes() < bytes; });
}

}  // namespace kiln
