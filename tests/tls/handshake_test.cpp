// Who is let in, and what both sides read when one is not. Real connections on loopback.
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "common/base/files.h"
#include "coordinator/farm/authority/tokens.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {
using test::Farm;
using test::kDay;
using test::TlsPair;

ListenOptions with(std::shared_ptr<const TlsContext> tls) {
  ListenOptions options;
  options.tls = std::move(tls);
  return options;
}

TEST(Handshake, GoodCertificatesMeet) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  const auto worker = farm.context("render7", {Role::kWorker, Role::kRead});
  p.connect(worker);
  p.open();
  EXPECT_TRUE(p.server->encrypted());
  EXPECT_EQ(p.server->peer_identity().name, "render7");
  EXPECT_EQ(p.server->peer_identity().roles, (std::vector<Role>{Role::kWorker, Role::kRead}));
  EXPECT_EQ(p.server->peer_identity().serial, worker->own().identity.serial);
  EXPECT_EQ(p.server->peer_identity().not_after, worker->own().identity.not_after);
  EXPECT_EQ(p.client->peer_identity().name, "farm");
  p.client->send(Heartbeat{7, 0});
  p.server->send(Goodbye{"all done"});
  p.run([&] { return p.at_server.size() + p.at_client.size() == 2; });
  EXPECT_EQ(std::get<Heartbeat>(p.at_server[0]).running, 7u);
  EXPECT_EQ(std::get<Goodbye>(p.at_client[0]).reason, "all done");
}

TEST(Handshake, HostsMayBeNamesToo) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.worker(), "localhost");
  p.open();
}

TEST(Handshake, PlainStaysPlain) {
  TlsPair p({});
  p.connect(nullptr);
  p.open();
  EXPECT_FALSE(p.server->encrypted());
  EXPECT_EQ(p.server->peer_identity().serial, "");
  EXPECT_FALSE(p.server->peer_identity().has(Role::kWorker));
}

TEST(Handshake, AWorkerOfAnotherAuthority) {
  Farm farm, other;
  TlsPair p(with(farm.coordinator()));
  // It trusts this farm and shows another's certificate.
  TlsFiles files = other.files("render7", {Role::kWorker});
  const auto both = [&](const Farm& f) { return *read_file(f.ca_dir() / "ca.pem"); };
  Bytes bundle = both(farm);
  const Bytes second = both(other);
  bundle.insert(bundle.end(), second.begin(), second.end());
  files.ca = other.path() / "both.pem";
  ASSERT_TRUE(write_file_atomic(files.ca, bundle));
  p.connect(*TlsContext::load(files));
  EXPECT_SAYS(p.server_words(), "(render7");
  EXPECT_SAYS(p.refused, "not the authority in this side's ca.pem");
  EXPECT_SAYS(p.client_words(), "does not know the authority that signed this side's certificate");
  EXPECT_EQ(p.accepted, 0);
}

TEST(Handshake, ACoordinatorOfAnotherAuthority) {
  Farm farm, other;
  TlsPair p(with(other.coordinator()));
  p.connect(farm.worker());
  EXPECT_SAYS(p.client_words(), "(farm, serial");
  EXPECT_SAYS(p.client_failed, "not the authority in this side's ca.pem");
  EXPECT_SAYS(p.server_words(), "does not know the authority that signed this side's certificate");
}

TEST(Handshake, Expired) {
  Farm farm;
  {
    TlsPair p(with(farm.coordinator()));
    p.connect(farm.context("render7", {Role::kWorker}, -10 * kDay, -kDay));
    EXPECT_SAYS(p.server_words(), "expired on " + date_text(test::now() - kDay).substr(0, 10));
    EXPECT_SAYS(p.client_words(), "expired");
    EXPECT_EQ(p.accepted, 0);
  }
  TlsPair p(with(farm.context("farm", {Role::kCoordinator}, -10 * kDay, -kDay)));
  p.connect(farm.worker());
  EXPECT_SAYS(p.client_words(), "expired on " + date_text(test::now() - kDay).substr(0, 10));
  EXPECT_SAYS(p.server_words(), "expired");
}

TEST(Handshake, NotYetValid) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.context("render7", {Role::kWorker}, 10 * kDay, 20 * kDay));
  EXPECT_SAYS(p.server_words(), "is valid from " + date_text(test::now() + 10 * kDay).substr(0, 10));
  EXPECT_SAYS(p.refused, "clocks");
  EXPECT_SAYS(p.client_words(), "not valid yet");
}

TEST(Handshake, ACallerWithoutARole) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.context("mail-server", {}));
  EXPECT_SAYS(p.server_words(), "(mail-server) has no role of a farm");
  EXPECT_SAYS(p.client_words(), "roles do not fit");
  EXPECT_EQ(p.accepted, 0);
}

// A worker's certificate must not play the coordinator for other workers, nor one of another use of the
// authority.
TEST(Handshake, AServerThatIsNoCoordinator) {
  Farm farm;
  for (const bool worker : {true, false}) {
    const test::RawServer server(
        farm.files("render8", worker ? std::vector<Role>{Role::kWorker} : std::vector<Role>()));
    EventLoop loop;
    std::string words;
    connect_to(
        loop, "127.0.0.1", server.port(), std::chrono::seconds(20),
        [&](auto c) { words = c ? "let in" : c.error().message; }, farm.worker());
    loop.run_until([&] { return !words.empty(); });
    EXPECT_SAYS(words, "render8");
    if (worker)
      EXPECT_PRED1(
          [](const std::string& w) {
            return w.find("does not speak for") != w.npos || w.find("may not be a coordinator's") != w.npos;
          },
          words);
    else
      EXPECT_SAYS(words, "has the roles none, not coordinator");
  }
  const auto opened = [&] {
    EventLoop loop;
    return Listener::open(
               loop, "127.0.0.1", 0, [](auto) {}, with(farm.worker()))
        .error()
        .message;
  }();
  EXPECT_SAYS(opened, "render7");
  EXPECT_SAYS(opened, "--role coordinator");
}

TEST(Handshake, AnotherHostsCertificate) {
  Farm farm;
  farm.hosts = {"farm.studio.lan", "10.9.8.7"};
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.worker());
  EXPECT_SAYS(p.client_words(), "does not speak for 127.0.0.1, but for farm.studio.lan, 10.9.8.7");
  EXPECT_SAYS(p.client_failed, "--host 127.0.0.1");
}

TEST(Handshake, RevokedWhileTheListenerRuns) {
  Farm farm;
  const auto coordinator = farm.coordinator();
  const auto worker = farm.worker();
  {
    TlsPair p(with(coordinator));
    p.connect(worker);
    p.open();
  }
  ASSERT_TRUE(write_file_atomic(farm.ca_dir() / "revoked", worker->own().identity.serial + "  # stolen\n"));
  {
    TlsPair p(with(coordinator));
    p.connect(worker);
    EXPECT_SAYS(p.server_words(), "(render7, serial " + worker->own().identity.serial + ") was revoked");
    EXPECT_SAYS(p.client_words(), "was revoked");
    EXPECT_EQ(p.accepted, 0);
  }
  EXPECT_TRUE(*coordinator->is_revoked(worker->own().identity.serial));
  // While the list is damaged its last good state counts. A side that starts then lets nobody in.
  const auto other = farm.context("render9", {Role::kWorker});
  const TlsFiles late = farm.files("late", {Role::kCoordinator});
  ASSERT_TRUE(write_file_atomic(farm.ca_dir() / "revoked", std::string_view("what is this\n")));
  {
    TlsPair p(with(coordinator));
    p.connect(worker);
    EXPECT_SAYS(p.server_words(), "was revoked");
  }
  TlsPair p(with(coordinator));
  p.connect(other);
  p.open();
  const auto loaded = TlsContext::load(late);
  ASSERT_FALSE(loaded);
  EXPECT_SAYS(loaded.error().message, "line 1 is not a serial number");
}

TEST(Handshake, APlainWorkerAtATlsPort) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  p.connect(nullptr);
  p.run([&] { return p.client != nullptr; });
  p.client->send(Hello{"0.1.0", "token", "host", 1, 2, 3, "avx2", "embree"});
  EXPECT_SAYS(p.server_words(), "the peer speaks plain and this port TLS");
  p.run([&] { return !p.at_client.empty(); });
  EXPECT_SAYS(std::get<Refused>(p.at_client[0]).reason, "this coordinator speaks TLS");
}

TEST(Handshake, ATlsWorkerAtAPlainPort) {
  Farm farm;
  TlsPair p({});
  p.connect(farm.worker());
  EXPECT_SAYS(p.client_words(), "the peer speaks plain");
  EXPECT_SAYS(p.server_words(), "the peer speaks TLS and this side plain");
}

TEST(Handshake, AnotherPrograms) {
  Farm farm;
  for (const std::string& words : {std::string("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), std::string(300, '\x16'),
                                   std::string("\x16\x03\x01\x00\x05hello", 10), std::string(1, '\0')}) {
    TlsPair p(with(farm.coordinator()));
    const int fd = test::raw_connect(p.listener->port());
    ASSERT_EQ(::write(fd, words.data(), words.size()), static_cast<ssize_t>(words.size()));
    if (words.size() == 1) ::shutdown(fd, SHUT_WR);
    EXPECT_NE(p.server_words(), "") << words.substr(0, 10);
    (void)test::raw_read(p, fd);  // and the socket is closed
    EXPECT_EQ(p.accepted, 0);
    ::close(fd);
  }
}

TEST(Handshake, Tls12IsRefused) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  std::thread caller(test::connect_with_tls12, p.listener->port());
  EXPECT_SAYS(p.server_words(), "does not speak TLS 1.3");
  p.run([&, ended = false]() mutable { return ended || (ended = p.accepted == 0); });
  p.loop.run_ready();
  p.listener.reset();
  caller.join();
}

TEST(Handshake, ASilentCallerHasADeadlineAndBlocksNobody) {
  Farm farm;
  ListenOptions options = with(farm.coordinator());
  options.handshake_deadline = std::chrono::milliseconds(60'000);
  options.max_half_open = 2;
  options.half_open_grace = std::chrono::milliseconds(0);
  std::vector<std::string> reasons;
  options.on_refused = [&](const std::string&, const std::string& reason) { reasons.push_back(reason); };
  TlsPair p(options);
  std::vector<int> silent;
  for (int i = 0; i < 5; ++i) silent.push_back(test::raw_connect(p.listener->port()));
  p.connect(farm.worker());
  p.run([&] { return p.server && p.client; });
  // Two places and six callers: at least three of the silent ones made room.
  EXPECT_GE(reasons.size(), 3u);
  for (const std::string& reason : reasons) EXPECT_SAYS(reason, "others wait");
  for (const int fd : silent) ::close(fd);

  options.handshake_deadline = std::chrono::milliseconds(20);
  options.on_refused = nullptr;
  TlsPair q(options);
  const int fd = test::raw_connect(q.listener->port());
  EXPECT_SAYS(q.server_words(), "no hand-shake of TLS within 0.02 s");
  EXPECT_EQ(test::raw_read(q, fd), "");
  ::close(fd);
}

TEST(Handshake, NoCertificateButForAnEnrolment) {
  Farm farm, other;
  const auto ca = read_certificate([&] {
    const Bytes pem = *read_file(farm.ca_dir() / "ca.pem");
    return std::string(reinterpret_cast<const char*>(pem.data()), pem.size());
  }());
  const auto stranger = *TlsContext::for_enrolment(ca->fingerprint);
  {
    TlsPair p(with(farm.coordinator()));
    p.connect(stranger);
    EXPECT_SAYS(p.server_words(), "shows no certificate");
    EXPECT_SAYS(p.client_words(), "asks for a certificate");
    EXPECT_EQ(p.accepted, 0);
  }
  ListenOptions options = with(farm.coordinator());
  options.admit_strangers = true;
  {
    TlsPair p(options);
    p.connect(stranger);
    p.open();
    EXPECT_EQ(p.server->peer_identity().serial, "");
    EXPECT_TRUE(p.server->encrypted());
    EXPECT_EQ(p.client->peer_identity().name, "farm");
  }
  {  // who shows one must still show a good one
    TlsPair p(options);
    p.connect(farm.context("render7", {Role::kWorker}, -10 * kDay, -kDay));
    EXPECT_SAYS(p.server_words(), "expired");
  }
  // A coordinator of another authority is not what the token meant.
  ListenOptions wrong = with(other.coordinator());
  wrong.admit_strangers = true;
  TlsPair p(wrong);
  p.connect(stranger);
  EXPECT_SAYS(p.client_words(), "not the authority");
}

}  // namespace
}  // namespace kiln
