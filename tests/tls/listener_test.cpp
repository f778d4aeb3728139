// Connections over TLS behave as plain ones do, and the listener outlives a shortage.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/wire/limits.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {
using test::Farm;
using test::TlsPair;

ListenOptions with(std::shared_ptr<const TlsContext> tls) {
  ListenOptions options;
  options.tls = std::move(tls);
  return options;
}

TEST(TlsConnection, DataGoesBothWaysAtOnce) {
  Farm farm;
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.worker());
  p.open();
  Bytes bytes(kChunkPieceBytes);
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 2654435761u >> 24);
  const ChunkPiece piece{{}, 0, bytes.size(), bytes, false};
  for (int i = 0; i < 6; ++i) {
    p.client->send(piece);
    p.server->send(piece);
  }
  p.run([&] { return p.at_server.size() == 6 && p.at_client.size() == 6; });
  for (const auto* end : {&p.at_server, &p.at_client})
    for (const Message& m : *end) EXPECT_EQ(std::get<ChunkPiece>(m).bytes, bytes);
}

TEST(TlsConnection, AnEndInOrderAndACut) {
  Farm farm;
  {
    TlsPair p(with(farm.coordinator()));
    p.connect(farm.worker());
    p.open();
    p.client->send(Goodbye{"done"});
    p.client->close_after_writes("done");
    p.run([&] { return !p.server_closed.empty(); });
    ASSERT_EQ(p.at_server.size(), 1u);
    EXPECT_SAYS(p.server_closed, "the peer closed the connection");
    p.server.reset();
    EXPECT_EQ(p.client_words(), "done");
  }
  TlsPair p(with(farm.coordinator()));
  p.connect(farm.worker());
  p.open();
  p.client->send(Goodbye{"half a word"});
  p.client.reset();  // no end of TLS: as if the machine, or somebody between, had cut it
  EXPECT_SAYS(p.server_words(), "was cut");
}

// The reason must survive what the peer still sends: a reset would take it away.
TEST(TlsConnection, LastWordsArriveThoughThePeerTalks) {
  Farm farm;
  for (int round = 0; round < 5; ++round) {
    TlsPair p(with(farm.coordinator()));
    p.connect(farm.worker());
    p.open();
    const ChunkPiece piece{{}, 0, 1 << 20, Bytes(1 << 20), false};
    for (int i = 0; i < 12; ++i) p.client->send(piece);
    p.server->send(Refused{"not you"});
    p.server->close_after_writes("refused");
    p.run([&] { return !p.at_client.empty() || !p.client_closed.empty(); });
    ASSERT_EQ(p.at_client.size(), 1u) << p.client_closed;
    EXPECT_EQ(std::get<Refused>(p.at_client[0]).reason, "not you");
    p.client.reset();
    p.run([&] { return !p.server_closed.empty(); });
    EXPECT_EQ(p.server_closed, "refused");
  }
}

TEST(TlsConnection, DataBeforeTheHandShakeOfKilnIsRefused) {
  Farm farm;
  ListenOptions options = with(farm.coordinator());
  EventLoop loop;
  std::unique_ptr<Connection> server, client;
  std::string closed;
  const auto listener = *Listener::open(
      loop, "127.0.0.1", 0,
      [&](std::unique_ptr<Connection> c) {
        server = std::move(c);
        server->start({[](const FrameHeader&, auto) { ADD_FAILURE(); },
                       [&](const std::string& reason) { closed = reason; },
                       {}},
                      0);
      },
      options);
  connect_to(
      loop, "127.0.0.1", listener->port(), std::chrono::seconds(20),
      [&](auto c) {
        client = std::move(*c);
        client->start({[](const FrameHeader&, auto) {}, {}, {}}, 0);
        client->send(ChunkPiece{{}, 0, 1 << 20, Bytes(1 << 20), false});
      },
      farm.worker());
  loop.run_until([&] { return !closed.empty(); });
  EXPECT_SAYS(closed, "before the hand-shake");
}

// Out of file descriptors, then not: callers that waited are served.
TEST(Listener, OutlivesAShortageOfFileDescriptors) {
  for (const bool tls : {false, true}) {
    Farm farm;
    TlsPair p(tls ? with(farm.coordinator()) : ListenOptions{});
    const auto worker = tls ? farm.worker() : nullptr;
    p.connect(worker);
    p.open();  // what OpenSSL and the resolver open once is open
    const int caller = test::raw_connect(p.listener->port());
    rlimit before{};
    ::getrlimit(RLIMIT_NOFILE, &before);
    const rlimit few{64, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
    std::vector<int> taken;
    for (int fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC); fd >= 0;
         fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC))
      taken.push_back(fd);
    ASSERT_EQ(errno, EMFILE);
    bool waited = false;
    Timer wait(p.loop);
    wait.after(std::chrono::milliseconds(250), [&] { waited = true; });
    p.run([&] { return waited; });
    EXPECT_EQ(p.accepted, 1);
    for (const int fd : taken) ::close(fd);
    ::setrlimit(RLIMIT_NOFILE, &before);
    if (tls) {
      p.connect(worker);
      p.run([&] { return p.accepted == 2; });
    } else {
      p.run([&] { return p.accepted == 2; });
    }
    ::close(caller);
  }
}

// Files can be opened however many callers there are, and the callers that were in stay in.
TEST(Listener, CallersDoNotTakeTheLastFileDescriptors) {
  EventLoop loop;
  std::vector<std::unique_ptr<Connection>> in;
  auto listener = Listener::open(loop, "127.0.0.1", 0, [&](auto c) { in.push_back(std::move(c)); });
  ASSERT_TRUE(listener);
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const rlimit few{128, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<int> callers;
  bool waited = false;
  Timer wait(loop);
  for (int i = 0; i < 60; ++i) {
    callers.push_back(test::raw_connect((*listener)->port()));
    ASSERT_GE(callers.back(), 0);
    waited = false;
    wait.after(std::chrono::milliseconds(1), [&] { waited = true; });
    loop.run_until([&] { return waited; });
  }
  EXPECT_GE(in.size(), 30u);
  EXPECT_LT(in.size(), 60u);
  char byte;
  EXPECT_EQ(::recv(callers.back(), &byte, 1, 0), 0);  // closed: it may try again
  EXPECT_EQ(::recv(callers.front(), &byte, 1, MSG_DONTWAIT), -1);
  const int file = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  EXPECT_GE(file, 0);
  ::close(file);
  for (const int caller : callers) ::close(caller);
  ::setrlimit(RLIMIT_NOFILE, &before);
}

}  // namespace
}  // namespace kiln
