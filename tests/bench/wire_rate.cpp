// Rates of a connection on loopback, both ends in one thread: wire_rate. Plain and TLS: MiB/s of chunk
// pieces, small messages a second, and hand-shakes a second.
#include <cstdio>
#include <ctime>
#include <filesystem>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/wire/limits.h"
#include "common/wire/listener.h"
#include "coordinator/farm/authority/authority.h"

namespace kiln {
namespace {

struct Ends {
  EventLoop loop;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<Connection> server, client;
  size_t received = 0;

  explicit Ends(std::shared_ptr<const TlsContext> own) {
    ListenOptions options;
    options.tls = std::move(own);
    listener = *Listener::open(
        loop, "127.0.0.1", 0, [this](auto c) { server = std::move(c); }, std::move(options));
  }
  void connect(std::shared_ptr<const TlsContext> tls) {
    connect_to(
        loop, "127.0.0.1", listener->port(), std::chrono::seconds(10),
        [this](auto c) { client = std::move(*c); }, std::move(tls));
    loop.run_until([this] { return server && client; });
  }
  void start() {
    server->accept_data();
    server->start({[this](const FrameHeader&, auto) { ++received; }, {}, {}}, kChunkWriteBudget);
    client->start({[](const FrameHeader&, auto) {}, {}, {}}, kChunkWriteBudget);
  }
  double send(const Message& message, size_t count, size_t window) {
    const Stopwatch watch;
    received = 0;
    for (size_t sent = 0; received < count;) {
      for (; sent < count && sent - received < window; ++sent) client->send(message);
      const size_t before = received;
      loop.run_until([&] { return received != before; });
    }
    return watch.seconds();
  }
};

void measure(const char* name, const std::shared_ptr<const TlsContext>& listen,
             const std::shared_ptr<const TlsContext>& call) {
  Ends ends(listen);
  const Stopwatch shakes;
  constexpr int kShakes = 300;
  for (int i = 0; i < kShakes; ++i) {
    ends.server.reset();
    ends.client.reset();
    ends.connect(call);
  }
  const double shake_seconds = shakes.seconds();
  ends.start();
  Bytes noise(kChunkPieceBytes);
  for (size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<std::byte>(i * 2654435761u >> 24);
  constexpr size_t kPieces = 250, kSmall = 200'000;
  const double data = ends.send(ChunkPiece{{}, 0, noise.size(), noise, false}, kPieces, 2);
  const double small = ends.send(Heartbeat{1, 2, 3}, kSmall, 64);
  std::printf("%-6s %6.0f MiB/s  %8.0f messages/s  %6.0f connections/s\n", name, kPieces * 4 / data,
              kSmall / small, kShakes / shake_seconds);
}

void run() {
  std::string pattern = (std::filesystem::temp_directory_path() / "kiln-rate-XXXXXX").string();
  KILN_CHECK(::mkdtemp(pattern.data()) != nullptr);
  const std::filesystem::path dir = pattern;
  const int64_t now = std::time(nullptr);
  KILN_CHECK(make_authority_folder(dir / "ca", "ca", 2, now).has_value());
  KILN_CHECK(
      issue(dir / "ca", {"farm", {Role::kCoordinator}, {"127.0.0.1"}, 1}, dir / "farm", now).has_value());
  KILN_CHECK(issue(dir / "ca", {"worker", {Role::kWorker}, {}, 1}, dir / "worker", now).has_value());
  const auto farm = *TlsContext::load(tls_files_in(dir / "farm"));
  const auto worker = *TlsContext::load(tls_files_in(dir / "worker"));
  measure("plain", nullptr, nullptr);
  measure("TLS", farm, worker);
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace kiln

int main() {
  kiln::run();
}
