// A worker or a person's program that a certificate stands for, against a farm on its own thread.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "common/wire/listener.h"

namespace kiln::test {

class CertifiedPeer {
 public:
  CertifiedPeer(uint16_t port, std::shared_ptr<const TlsContext> tls);
  void send(const Message& message) { connection_->send(message); }
  // Skips to the next message of type T; empty if the connection ends, or nothing comes for half a minute.
  template <class T>
  std::optional<T> next() {
    while (auto message = receive())
      if (T* t = std::get_if<T>(&*message)) return std::move(*t);
    return std::nullopt;
  }
  std::optional<Message> receive();
  // What the connection ended with, here or at the coordinator; it must end.
  std::string end();

 private:
  EventLoop loop_;
  Timer limit_{loop_};
  std::unique_ptr<Connection> connection_;
  std::deque<Message> messages_;
  std::string ended_;
  bool late_ = false;
};

}  // namespace kiln::test
