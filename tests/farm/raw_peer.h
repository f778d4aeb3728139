// A peer that speaks frames over a blocking socket and can break every rule.
#pragma once

#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/wire/messages.h"

namespace kiln::test {

class RawPeer {
 public:
  static RawPeer connect(uint16_t port);
  static std::optional<RawPeer> try_connect(uint16_t port);
  explicit RawPeer(int fd);
  ~RawPeer();
  RawPeer(RawPeer&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  RawPeer(const RawPeer&) = delete;

  void send_bytes(std::span<const std::byte> bytes);
  void send(const Message& message) { send_bytes(encode(message)); }
  // The next whole frame, header and payload, its checksum not looked at; empty when the peer closed.
  std::optional<Bytes> receive_frame(int patience_ms);
  // The next message; empty when the peer closed, nothing came for `patience_ms` or it was malformed.
  std::optional<Message> receive(int patience_ms = 5000);
  // Skips to the next message of type T; empty if it does not come within `patience_ms`.
  template <class T>
  std::optional<T> next(int patience_ms = 5000) {
    const SteadyClock clock;
    const int64_t limit = clock.now_ms() + patience_ms;
    for (int64_t left = patience_ms; left >= 0; left = limit - clock.now_ms()) {
      auto m = receive(static_cast<int>(left));
      if (!m) break;
      if (T* t = std::get_if<T>(&*m)) return std::move(*t);
    }
    return std::nullopt;
  }
  bool closed(int patience_ms = 5000);  // the other end closed; what it sent before is dropped
  void close();
  void shut_down();  // as seen by the other end and by a thread that reads here; close() frees the number

 private:
  bool read_all(std::byte* to, size_t size, int patience_ms);
  int fd_;
};

class RawListener {
 public:
  RawListener();
  ~RawListener();
  uint16_t port() const { return port_; }
  std::optional<RawPeer> accept(int patience_ms = 5000);

 private:
  int fd_;
  uint16_t port_ = 0;
};

}  // namespace kiln::test
