// A farm's authority, identities of it, good and bad, and both ends of a connection on one loop.
#pragma once

#include <gtest/gtest.h>

#include <deque>

#include "common/wire/listener.h"
#include "coordinator/farm/authority/authority.h"

namespace kiln::test {

constexpr int64_t kDay = 86400;
int64_t now();

class Farm {
 public:
  Farm();
  std::filesystem::path ca_dir() const { return dir_.path() / "ca"; }
  std::filesystem::path path() const { return dir_.path(); }
  // Files of a new certificate, valid from `from` to `to`, seconds from now. Empty `roles`: a certificate
  // that this authority signed for another use, which names 127.0.0.1 and may be a server.
  TlsFiles files(const std::string& name, std::vector<Role> roles, int64_t from = -100,
                 int64_t to = 30 * kDay);
  // Loaded as of a time at which it is good. `host` is for coordinators.
  std::shared_ptr<const TlsContext> context(const std::string& name, std::vector<Role> roles,
                                            int64_t from = -100, int64_t to = 30 * kDay);
  std::shared_ptr<const TlsContext> coordinator() { return context("farm", {Role::kCoordinator}); }
  std::shared_ptr<const TlsContext> worker() { return context("render7", {Role::kWorker}); }
  std::vector<std::string> hosts{"127.0.0.1", "localhost"};  // of coordinators

 private:
  TempDir dir_;
  KeyAndCertificate authority_;
};

struct TlsPair {
  explicit TlsPair(ListenOptions options);
  void connect(std::shared_ptr<const TlsContext> tls, const std::string& host = "127.0.0.1");
  void run(const std::function<bool()>& done);
  // Runs until both ends stand, and starts them.
  void open();
  // Runs until the client has heard that it is not welcome, by its connection or at once; the sentence.
  std::string client_words();
  std::string server_words();  // that on_refused or the server's connection was closed with

  EventLoop loop;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<Connection> server, client;
  std::deque<Message> at_server, at_client;
  std::string refused, server_closed, client_failed, client_closed;
  int accepted = 0;
  Timer limit{loop};
  bool late = false;

 private:
  void start(Connection& connection, std::deque<Message>& messages, std::string& closed);
};

// A plain TCP socket to the port; the kernel takes it before the listener does.
int raw_connect(uint16_t port);
// What the peer says until it closes, while the loop runs.
std::string raw_read(TlsPair& pair, int fd);

// OpenSSL on a thread: connects with at most TLS 1.2 and ends.
void connect_with_tls12(uint16_t port);
// OpenSSL on a thread: shows these files to one caller, and ends. The port.
class RawServer {
 public:
  explicit RawServer(const TlsFiles& files);
  ~RawServer();
  uint16_t port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln::test

#define EXPECT_SAYS(message, part)                                                             \
  EXPECT_PRED2([](const std::string& m, const std::string& p) { return m.find(p) != m.npos; }, \
               std::string(message), std::string(part))
