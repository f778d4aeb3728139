#include "common/wire/connection.h"

#include "common/base/clock.h"
#include "common/wire/limits.h"
#include "common/wire/listener.h"

namespace kiln {
namespace {

// Both ends on one loop.
struct Pair {
  EventLoop loop;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<Connection> server, client;
  std::vector<Message> received;  // by the server
  std::string server_closed, client_closed;
  Timer limit{loop};
  bool late = false;

  Pair() {
    listener = *Listener::open(loop, "127.0.0.1", 0, [this](auto c) { server = std::move(c); });
    connect_to(loop, "127.0.0.1", listener->port(), std::chrono::seconds(5),
               [this](auto c) { client = std::move(*c); });
    limit.after(std::chrono::seconds(20), [this] { late = true; });
    run([this] { return server && client; });
  }
  void run(const std::function<bool()>& done) {
    loop.run_until([&] { return late || done(); });
    ASSERT_FALSE(late);
  }
  void start_server() {
    Connection::Handlers h;
    h.on_frame = [this](const FrameHeader& header, auto payload) {
      received.push_back(*decode(header, payload));
    };
    h.on_closed = [this](const std::string& reason) { server_closed = reason; };
    server->start(std::move(h), kChunkWriteBudget);
  }
  void start_client(std::function<void()> on_room = {}) {
    Connection::Handlers h;
    h.on_frame = [](const FrameHeader&, auto) {};
    h.on_closed = [this](const std::string& reason) { client_closed = reason; };
    h.on_room = std::move(on_room);
    client->start(std::move(h), kChunkWriteBudget);
  }
};

TEST(Connection, MessagesArriveInOrder) {
  Pair p;
  p.start_server();
  p.start_client();
  for (uint32_t i = 0; i < 1000; ++i) p.client->send(Heartbeat{i, 0});
  p.run([&] { return p.received.size() == 1000; });
  for (uint32_t i = 0; i < 1000; ++i) EXPECT_EQ(std::get<Heartbeat>(p.received[i]).running, i);
}

TEST(Connection, WhatIsQueuedIsSentBeforeAClose) {
  Pair p;
  p.start_server();
  p.start_client();
  p.client->send(Goodbye{"done"});
  p.client->close_after_writes("done");
  p.run([&] { return !p.server_closed.empty() && !p.client_closed.empty(); });
  ASSERT_EQ(p.received.size(), 1u);
  EXPECT_EQ(p.client_closed, "done");
}

TEST(Connection, DataBeforeTheHandShakeClosesTheConnection) {
  for (const bool accepted : {false, true}) {
    Pair p;
    p.start_server();
    p.start_client();
    if (accepted) p.server->accept_data();
    p.client->send(ChunkPiece{{}, 0, 1 << 20, Bytes(1 << 20), false});
    p.run([&] { return !p.server_closed.empty() || !p.received.empty(); });
    EXPECT_EQ(p.received.size(), accepted ? 1u : 0u);
  }
}

TEST(Connection, APeerThatDoesNotReadIsClosedAtTheBound) {
  Pair p;
  p.start_client();  // the server's end never reads
  const ChunkPiece piece{{}, 0, kChunkPieceBytes, Bytes(kChunkPieceBytes), false};
  size_t most = 0;
  for (int i = 0; i < 40; ++i) {
    p.client->send(piece);
    most = std::max(most, p.client->queued_bytes());
    p.loop.run_ready();
  }
  p.run([&] { return !p.client_closed.empty(); });
  EXPECT_LE(most, kMaxQueuedBytes);
  EXPECT_NE(p.client_closed.find("stopped reading"), std::string::npos);
}

TEST(Connection, ServingOnRoomKeepsTheQueueNearItsBudget) {
  Pair p;
  p.server->accept_data();
  p.start_server();
  const ChunkPiece piece{{}, 0, 1 << 20, Bytes(1 << 20), false};
  int left = 40;
  size_t most = 0;
  const auto serve = [&] {
    for (; left > 0 && p.client->queued_bytes() < kChunkWriteBudget; --left) p.client->send(piece);
    most = std::max(most, p.client->queued_bytes());
  };
  p.start_client(serve);
  serve();
  p.run([&] { return p.received.size() == 40; });
  EXPECT_LT(most, kChunkWriteBudget + (2u << 20));
}

TEST(Connection, AddressesAreParsed) {
  EXPECT_EQ(*parse_address("render7:7800"), std::pair(std::string("render7"), uint16_t{7800}));
  EXPECT_EQ(parse_address("[::1]:80")->first, "::1");
  for (const char* bad : {"", ":1", "host", "host:", "host:0", "host:65536", "host:12x"})
    EXPECT_FALSE(parse_address(bad)) << bad;
}

}  // namespace
}  // namespace kiln
