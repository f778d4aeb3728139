// Internal to common/wire.
#pragma once

#include <deque>
#include <optional>

#include "common/wire/connection.h"
#include "common/wire/event_loop_impl.h"
#include "common/wire/limits.h"
#include "common/wire/tls_impl.h"

namespace kiln {

struct Connection::Impl : std::enable_shared_from_this<Connection::Impl> {
  // A deadline that is set and cleared for each message. Its timer is armed once and looks at the due time
  // when it fires: arming and cancelling it for each message cost more than the message itself.
  class Deadline {
   public:
    explicit Deadline(const asio::any_io_executor& executor) : timer_(executor) {}
    // For a message of so many bytes; nothing if the owner has no limits. The timer keeps the owner alive
    // until it lapses or is ended.
    void set(Impl& owner, size_t bytes, void (Impl::*expired)());
    void clear() { due_.reset(); }
    void end();

   private:
    void arm(std::shared_ptr<Impl> owner, void (Impl::*expired)());

    asio::steady_timer timer_;
    std::optional<asio::steady_timer::time_point> due_;
    bool armed_ = false;
  };

  explicit Impl(asio::ip::tcp::socket s);
  void read_header();
  void on_first_bytes(size_t size);
  void on_header();
  void on_bad_header(const Error& error);
  void expect_message();
  void expect_payload();
  void read_payload();
  void wait_for_memory();
  void on_message();
  void on_read_error(const asio::error_code& code);
  void on_late_message();
  void on_late_reader();
  void write_next();
  void shut(std::string reason);  // closes the socket and reports once
  void linger_then_shut();
  // Reports `reason`, sends these bytes unencrypted, and releases the socket when the peer closes it, or
  // after 2 s. Then calls `ended`.
  void part(std::string reason, Bytes last_words, std::function<void()> ended = {});
  void drain(std::function<void()> ended);
  void report(const std::string& reason);

  // The only place where plain TCP and TLS differ: one branch per message, none per byte.
  template <class Handler>
  void read(asio::mutable_buffer buffer, size_t at_least, Handler handler) {
    if (tls)
      asio::async_read(*tls, buffer, asio::transfer_at_least(at_least), std::move(handler));
    else
      asio::async_read(socket, buffer, asio::transfer_at_least(at_least), std::move(handler));
  }
  template <class Handler>
  void write(asio::const_buffer buffer, Handler handler) {
    if (tls)
      asio::async_write(*tls, buffer, std::move(handler));
    else
      asio::async_write(socket, buffer, std::move(handler));
  }

  asio::ip::tcp::socket socket;
  asio::steady_timer linger;
  Deadline arriving, leaving;
  std::optional<PeerLimits> limits;
  std::shared_ptr<const TlsContext> context;
  PeerCheck check;
  std::unique_ptr<TlsStream> tls;  // over `socket`; null: plain
  PeerIdentity identity;
  std::string peer;
  bool loopback = false;
  Handlers handlers;
  size_t budget = 0;
  std::array<std::byte, kFrameHeaderBytes> head{};
  FrameHeader header;
  Bytes payload;                                // grows as bytes arrive
  size_t arrived = 0;                           // of the payload
  std::unique_ptr<ReceiveBudget::Share> share;  // of the limits' memory, for the message that is arriving
  std::deque<Bytes> queue;                      // the front is being written
  size_t queued = 0;
  uint32_t payload_limit = kMaxControlBytes;
  bool writing = false, closing = false, shut_down = false;
  std::string close_reason;
};

// Whether bytes that should start a frame start a TLS record (RFC 8446, section 5.1) instead.
bool begins_like_tls(std::span<const std::byte> bytes);

}  // namespace kiln
