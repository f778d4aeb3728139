// What a peer may cost the side it connects to: memory, time.
#include "common/wire/limits.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "common/wire/listener.h"

namespace kiln {
namespace {

size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<size_t>(::sysconf(_SC_PAGESIZE));
}

// The server's ends of raw sockets, on one loop.
struct Door {
  EventLoop loop;
  std::shared_ptr<ReceiveBudget> memory = ReceiveBudget::make(kReceiveBytes, kReceiveBytesOfCaller);
  std::chrono::milliseconds patience = kMessagePatience;
  uint32_t max_bytes = kMaxDataBytes;
  std::vector<std::unique_ptr<Connection>> accepted;
  std::vector<std::string> closed;
  size_t messages = 0;
  std::unique_ptr<Listener> listener;
  std::vector<int> sockets;
  Timer limit{loop};
  bool late = false;

  Door() {
    listener =
        *Listener::open(loop, "127.0.0.1", 0, [this](auto connection) { take(std::move(connection)); });
    limit.after(std::chrono::seconds(60), [this] { late = true; });
  }
  ~Door() {
    for (const int socket : sockets) ::close(socket);
  }
  void take(std::unique_ptr<Connection> connection) {
    connection->set_limits({memory, connection->caller(), patience});
    connection->accept_data(max_bytes);
    connection->start({[this](const FrameHeader&, auto) { ++messages; },
                       [this](const std::string& why) { closed.push_back(why); },
                       {}},
                      1 << 20);
    accepted.push_back(std::move(connection));
  }
  int call() {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(listener->port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    sockets.push_back(socket);
    const size_t before = accepted.size();
    run([&] { return accepted.size() > before; });
    return socket;
  }
  void run(const std::function<bool()>& done) {
    loop.run_until([&] { return late || done(); });
    ASSERT_FALSE(late);
  }
};

Bytes piece_frame(size_t bytes) {
  return encode(ChunkPiece{{}, 0, bytes, Bytes(bytes, std::byte{7}), false});
}

void say(int socket, std::span<const std::byte> bytes) {
  ASSERT_EQ(::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
}

TEST(Limits, AnAnnouncedLengthCostsNothingUntilItsBytesArrive) {
  Door door;
  const Bytes frame = piece_frame(8u << 20);
  const size_t before = resident_bytes();
  for (int i = 0; i < 100; ++i) say(door.call(), std::span(frame).first(kFrameHeaderBytes + 100));
  door.loop.run_ready();
  EXPECT_LT(resident_bytes(), before + (size_t{100} << 20));  // 800 MiB are announced
  EXPECT_EQ(door.memory->reserved(), 0u);
  EXPECT_TRUE(door.closed.empty());
}

TEST(Limits, AMessageThatDoesNotEndClosesItsConnection) {
  Door door;
  door.patience = std::chrono::milliseconds(50);
  const Bytes frame = encode(Heartbeat{1, 0});
  const int silent = door.call();  // says nothing at all: that is its right here
  say(door.call(), std::span(frame).first(3));
  say(door.call(), std::span(frame).first(kFrameHeaderBytes + 1));
  door.run([&] { return door.closed.size() == 2; });
  for (const std::string& why : door.closed) EXPECT_EQ(why, "a message did not arrive whole in time");
  say(silent, frame);
  door.run([&] { return door.messages == 1; });
}

TEST(Limits, AReplyThatIsNotReadClosesItsConnection) {
  Door door;
  door.patience = std::chrono::milliseconds(50);
  door.call();
  // More than the buffers of both ends hold; each message may take 2 s on the slowest link.
  for (int i = 0; i < 512 && door.closed.empty(); ++i)
    door.accepted[0]->send(ChunkPiece{{}, 0, 64u << 10, Bytes(64u << 10, std::byte{7}), false});
  door.run([&] { return !door.closed.empty(); });
  EXPECT_EQ(door.closed[0], "the peer stopped reading");
  EXPECT_LT(door.accepted[0]->queued_bytes(), kMaxQueuedBytes) << "by the deadline, not by the queue's size";
}

// Deadlines of messages that came and went do not close a connection that is silent after them.
TEST(Limits, ADeadlineEndsWithItsMessage) {
  Door door;
  door.patience = std::chrono::milliseconds(40);
  const Bytes frame = encode(Heartbeat{1, 0});
  const int socket = door.call();
  for (size_t i = 1; i <= 3; ++i) {
    say(socket, std::span(frame).first(5));
    door.loop.run_ready();
    say(socket, std::span(frame).subspan(5));
    door.run([&] { return door.messages == i; });
    bool waited = false;
    Timer pause(door.loop);
    pause.after(std::chrono::milliseconds(60), [&] { waited = true; });
    door.run([&] { return waited; });
  }
  EXPECT_TRUE(door.closed.empty()) << door.closed[0];
  say(socket, std::span(frame).first(5));
  door.run([&] { return !door.closed.empty(); });
  EXPECT_EQ(door.closed[0], "a message did not arrive whole in time");
}

TEST(Limits, MessagesLargerThanTheCallersRoleAllowsAreRefused) {
  Door door;
  door.max_bytes = kMaxReaderBytes;
  const Bytes frame = piece_frame(1u << 20);
  say(door.call(), std::span(frame).first(kFrameHeaderBytes));
  door.run([&] { return door.closed.size() == 1; });
  EXPECT_NE(door.closed[0].find("this caller's may have"), std::string::npos) << door.closed[0];
}

TEST(Limits, AMessageThatArrivesHoldsItsMemoryAndThenGivesItBack) {
  Door door;
  const Bytes frame = piece_frame(1u << 20);
  const int socket = door.call();
  say(socket, std::span(frame).first(frame.size() / 2));
  door.run([&] { return door.memory->reserved() > 0; });
  EXPECT_LT(door.memory->reserved(), frame.size());
  say(socket, std::span(frame).subspan(frame.size() / 2));
  door.run([&] { return door.messages == 1; });
  EXPECT_EQ(door.memory->reserved(), 0u);
  say(socket, std::span(frame).first(frame.size() / 2));
  door.run([&] { return door.memory->reserved() > 0; });
  ::shutdown(socket, SHUT_RDWR);
  door.run([&] { return door.closed.size() == 1; });
  EXPECT_EQ(door.memory->reserved(), 0u);
}

// A budget for one message at a time: nobody is forgotten.
TEST(Limits, MessagesThatWaitForMemoryAllArrive) {
  Door door;
  door.memory = ReceiveBudget::make(1u << 20, 1u << 20);
  const Bytes frame = piece_frame(300u << 10);
  constexpr size_t kCallers = 12;
  for (size_t i = 0; i < kCallers; ++i) door.call();
  size_t sent = 0;
  std::vector<size_t> at(kCallers, 0);
  while (sent < kCallers) {
    for (size_t i = 0; i < kCallers; ++i) {
      if (at[i] == frame.size()) continue;
      const ssize_t put = ::send(door.sockets[i], frame.data() + at[i],
                                 std::min<size_t>(65536, frame.size() - at[i]), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (put > 0) at[i] += static_cast<size_t>(put);
      sent += at[i] == frame.size();
    }
    door.loop.run_ready();
    ASSERT_LE(door.memory->reserved(), size_t{1} << 20);
  }
  door.run([&] { return door.messages == kCallers; });
  EXPECT_EQ(door.memory->reserved(), 0u);
}

TEST(ReceiveBudget, FirstComeFirstServedButNobodyTakesMoreThanItsPart) {
  const auto budget = ReceiveBudget::make(100, 50);
  std::string granted;
  const auto ask = [&](const char* caller, size_t bytes, char name) {
    return ReceiveBudget::reserve(budget, caller, bytes, [&granted, name] { granted += name; });
  };
  auto a = ask("ada", 40, 'a');
  auto b = ask("ada", 20, 'b');  // beyond ada's part
  auto c = ask("bob", 50, 'c');  // not kept waiting by it
  EXPECT_EQ(granted, "ac");
  auto d = ask("eve", 30, 'd');  // no room
  auto e = ask("joe", 5, 'e');   // would fit, but comes after
  EXPECT_EQ(granted, "ac");
  EXPECT_EQ(budget->reserved(), 90u);
  c.reset();
  EXPECT_EQ(granted, "acde");
  a.reset();
  EXPECT_EQ(granted, "acdeb");
  d.reset(), e.reset(), b.reset();
  EXPECT_EQ(budget->reserved(), 0u);
  auto huge = ask("ada", 1000, 'h');  // alone, any message fits
  EXPECT_EQ(granted, "acdebh");
  auto gone = ask("ada", 1, 'g');
  gone.reset();
  huge.reset();
  EXPECT_EQ(granted, "acdebh") << "one that gave up is not granted";
  auto most = ask("ada", 50, 'm');
  auto large = ask("bob", 60, 'l');  // waits, and those behind it with it
  auto small = ask("eve", 10, 's');
  EXPECT_EQ(granted, "acdebhm");
  large.reset();
  EXPECT_EQ(granted, "acdebhms");
}

}  // namespace
}  // namespace kiln
