// Internal to common/wire: upgrades a TCP connection to TLS, or explains why not.
#pragma once

#include "common/wire/connection_impl.h"

namespace kiln {

class Handshake : public std::enable_shared_from_this<Handshake> {
 public:
  using Done = std::function<void(const std::string& peer, Expected<std::unique_ptr<Connection>>)>;

  Handshake(std::shared_ptr<Connection::Impl> connection, std::shared_ptr<const TlsContext> context);
  // `done` is called once, from the loop or from give_up; `ended` when the socket was handed over or closed.
  // A refused peer is told the reason first.
  void serve(bool admit_strangers, std::chrono::milliseconds deadline, Done done,
             std::function<void()> ended);
  void call(const std::string& host, std::chrono::milliseconds deadline, Done done);
  void give_up(const std::string& reason);  // closes at once
  std::chrono::steady_clock::time_point begun() const { return begun_; }

 private:
  void start(std::chrono::milliseconds deadline, Done done, std::function<void()> ended);
  void look_at_first_byte(bool admit_strangers);
  void shake(asio::ssl::stream_base::handshake_type side);
  void finish();
  void refuse(const std::string& reason, Bytes last_words);
  void end();

  std::shared_ptr<Connection::Impl> connection_;
  std::shared_ptr<const TlsContext> context_;
  asio::steady_timer timer_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  Done done_;
  std::function<void()> ended_;
};

}  // namespace kiln
