// A peer that speaks frames over a blocking socket and can break every rule.
#pragma once

#include <optional>
#include <string>

#include "common/wire/messages.h"

namespace kiln::test {

class RawPeer {
 public:
  static RawPeer connect(uint16_t port);
  explicit RawPeer(int fd);
  ~RawPeer();
  RawPeer(RawPeer&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  RawPeer(const RawPeer&) = delete;

  void send_bytes(std::span<const std::byte> bytes);
  void send(const Message& message) { send_bytes(encode(message)); }
  // The next message; empty when the peer closed, nothing came for `patience_ms` or it was malformed.
  std::optional<Message> receive(int patience_ms = 5000);
  // Skips to the next message of type T.
  template <class T>
  std::optional<T> next(int patience_ms = 5000) {
    while (auto m = receive(patience_ms))
      if (T* t = std::get_if<T>(&*m)) return std::move(*t);
    return std::nullopt;
  }
  bool closed(int patience_ms = 5000);  // the other end closed; what it sent before is dropped
  void close();

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
