#include "common/wire/link.h"

#include "common/base/check.h"

namespace kiln {
namespace {

class SocketLink final : public Link {
 public:
  explicit SocketLink(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {
    KILN_CHECK(connection_ != nullptr);
  }
  void start(Connection::Handlers handlers, size_t budget) override {
    connection_->start(std::move(handlers), budget);
  }
  void accept_data(uint32_t max_bytes) override { connection_->accept_data(max_bytes); }
  void send(const Message& message) override { connection_->send(message); }
  size_t queued_bytes() const override { return connection_->queued_bytes(); }
  void drop_queued() override { connection_->drop_queued(); }
  void close_after_writes(std::string reason) override { connection_->close_after_writes(std::move(reason)); }
  std::string peer() const override { return connection_->peer(); }
  std::string caller() const override { return connection_->caller(); }
  bool loopback() const override { return connection_->loopback(); }
  const PeerIdentity& peer_identity() const override { return connection_->peer_identity(); }

 private:
  std::unique_ptr<Connection> connection_;
};

}  // namespace

std::unique_ptr<Link> make_link(std::unique_ptr<Connection> connection) {
  return std::make_unique<SocketLink>(std::move(connection));
}

}  // namespace kiln
