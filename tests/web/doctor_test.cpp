// Every step of the doctor that can be made to fail on loopback, and the words that a user sees.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <thread>

#include "common/base/format.h"
#include "common/wire/limits.h"
#include "coordinator/cli/doctor_server.h"
#include "coordinator/cli/doctor_steps.h"
#include "coordinator/farm/authority/authority.h"
#include "coordinator/farm/dispatch/farm.h"

namespace kiln {
namespace {

using Steps = std::vector<DoctorStep>;

Steps examine(const DoctorPlan& plan) {
  return run_doctor(plan, [](const DoctorStep&) {});
}

// The doctor stops at the first bad step.
void expect_end(const Steps& steps, const std::string& name, const std::string& words) {
  ASSERT_FALSE(steps.empty());
  const DoctorStep& last = steps.back();
  EXPECT_FALSE(last.good);
  EXPECT_EQ(last.name, name) << last.finding;
  EXPECT_NE(last.finding.find(words), std::string::npos) << last.finding;
  EXPECT_FALSE(last.remedy.empty());
  for (size_t i = 0; i + 1 < steps.size(); ++i) EXPECT_TRUE(steps[i].good) << steps[i].finding;
}

class Talk final : public ClientTalk {
 public:
  Talk(ClientLink& link, int64_t off_ms) : link_(link), off_ms_(off_ms) {}
  std::string role() const override { return "submit"; }
  uint32_t max_message_bytes() const override { return kMaxDataBytes; }
  void on_request(Request request) override {
    using namespace std::chrono;
    const int64_t now = duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
    const std::string document =
        off_ms_ < 0 ? "{}" : text("{{\"now_ms\": {}{}}}", now + off_ms_, revocations ? revocations() : "");
    link_.send(Reply{request.id, true, ErrorKind::kInternal, document});
  }
  void on_piece(ChunkPiece) override {}
  Status on_chunk_request(ChunkRequest) override { return {}; }
  void on_room() override {}
  static inline std::function<std::string()> revocations;  // more members of the status

 private:
  ClientLink& link_;
  int64_t off_ms_;
};

// A coordinator whose clock is `off_ms` ahead; negative: it does not tell.
struct TestServer {
  explicit TestServer(int64_t off_ms = -1, std::shared_ptr<const TlsContext> tls = nullptr) {
    FarmSettings settings;
    settings.local_workers = 0;
    settings.token = tls ? "" : "right";
    settings.tls = std::move(tls);
    settings.clients.admit = [off_ms](const ClientHello& hello, const PeerIdentity& identity,
                                      ClientLink& link) -> Expected<std::unique_ptr<ClientTalk>> {
      if (identity.name.empty() && hello.token != "right")
        return fail(ErrorKind::kUsage, "the token is not this coordinator's");
      return std::make_unique<Talk>(link, off_ms);
    };
    farm = std::move(*Farm::start(settings));
    plan.server = text("127.0.0.1:{}", farm->port());
    plan.token = "right";
    plan.worker_program = "/bin/echo";
  }
  std::unique_ptr<Farm> farm;
  DoctorPlan plan;
};

int listen_on_loopback(int backlog, uint16_t& port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_EQ(::listen(fd, backlog), 0);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  port = ntohs(address.sin_port);
  return fd;
}

TEST(Doctor, FindsNothingWrongWithAGoodServer) {
  for (const bool worker : {false, true}) {
    TestServer server(2000);
    server.plan.worker = worker;
    const Steps steps = examine(server.plan);
    for (const DoctorStep& step : steps) EXPECT_TRUE(step.good) << step.name << ": " << step.finding;
    EXPECT_GE(steps.size(), 5u);
  }
}

TEST(Doctor, NamesAndPorts) {
  DoctorPlan plan;
  plan.server = "render1";
  expect_end(examine(plan), "address", "is not an address");
  plan.server = "nobody.invalid:7800";
  expect_end(examine(plan), "name", "does not resolve");
  uint16_t port = 0;
  ::close(listen_on_loopback(1, port));
  plan.server = text("127.0.0.1:{}", port);
  expect_end(examine(plan), "port", "refused");
}

TEST(Doctor, SilenceIsToldFromRefusal) {
  uint16_t port = 0;
  const int fd = listen_on_loopback(0, port);
  // The queue of connections is full: the next one gets no answer, as from a filter that drops packets.
  std::vector<int> callers;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int i = 0; i < 4; ++i) {
    callers.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    ::connect(callers.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  EXPECT_EQ(reach_port("127.0.0.1", port, 300).how, Reach::kNoAnswer);
  for (const int caller : callers) ::close(caller);
  ::close(fd);
}

TEST(Doctor, AnotherProgramHasThePort) {
  uint16_t port = 0;
  const int fd = listen_on_loopback(8, port);
  std::thread other([fd] {
    for (int i = 0; i < 2; ++i) {  // the look at the port, then the conversation
      const int peer = ::accept(fd, nullptr, nullptr);
      const char words[] = "HTTP/1.1 400 Bad Request\r\n\r\n";
      (void)!::send(peer, words, sizeof words - 1, MSG_NOSIGNAL);
      char dropped[256];
      (void)!::recv(peer, dropped, sizeof dropped, 0);
      ::close(peer);
    }
  });
  DoctorPlan plan;
  plan.server = text("127.0.0.1:{}", port);
  expect_end(examine(plan), "protocol", "does not speak Kiln's protocol");
  other.join();
  ::close(fd);
}

TEST(Doctor, Tokens) {
  TestServer server;
  server.plan.token = "wrong";
  expect_end(examine(server.plan), "token", "not this coordinator's");
  server.plan.worker = true;
  expect_end(examine(server.plan), "token", "not this coordinator's");
}

TEST(Doctor, Clocks) {
  expect_end(examine(TestServer(3600'000).plan), "clock", "3600.0 s ahead of");
  const Steps untold = examine(TestServer().plan);
  EXPECT_TRUE(untold.back().good);
}

TEST(Doctor, Certificates) {
  const test::TempDir folder;
  const std::string dir = folder.path() / "ca";
  const auto now = static_cast<int64_t>(std::time(nullptr));
  ASSERT_TRUE(make_authority_folder(dir, "farm", 30, now));
  const auto files = [&](const std::string& name) {
    const std::string at = folder.path() / name;
    return TlsFiles{at + "/ca.pem", at + "/cert.pem", at + "/key.pem"};
  };
  ASSERT_TRUE(issue(dir, {"farm1", {Role::kCoordinator}, {"127.0.0.1"}, 30}, folder.path() / "farm1", now));
  ASSERT_TRUE(
      issue(dir, {"elsewhere", {Role::kCoordinator}, {"10.9.9.9"}, 30}, folder.path() / "elsewhere", now));
  ASSERT_TRUE(issue(dir, {"render7", {Role::kWorker}, {}, 30}, folder.path() / "render7", now));
  ASSERT_TRUE(issue(dir, {"ada", {Role::kSubmit}, {}, 30}, folder.path() / "ada", now));
  ASSERT_TRUE(issue(dir, {"old", {Role::kSubmit}, {}, 1}, folder.path() / "old", now - 3 * 86400));

  TestServer server(0, *TlsContext::load(files("farm1")));
  server.plan.token.clear();
  expect_end(examine(server.plan), "protocol", "speaks TLS");
  server.plan.tls = files("render7");
  expect_end(examine(server.plan), "certificate", "roles");
  server.plan.tls = files("nobody");
  expect_end(examine(server.plan), "certificate", "nobody");
  server.plan.tls = files("old");
  expect_end(examine(server.plan), "certificate", "expired");
  server.plan.tls = files("ada");
  EXPECT_TRUE(examine(server.plan).back().good) << examine(server.plan).back().finding;
  server.plan.worker = true;
  server.plan.tls = files("render7");
  EXPECT_TRUE(examine(server.plan).back().good) << examine(server.plan).back().finding;

  TestServer stranger(0, *TlsContext::load(files("elsewhere")));
  stranger.plan.tls = files("ada");
  expect_end(examine(stranger.plan), "hand-shake", "127.0.0.1");
  TestServer plain(0);
  plain.plan.tls = files("ada");
  expect_end(examine(plain.plan), "protocol", "speaks plain");
}

TEST(Doctor, RevocationsThatTheCoordinatorHasNotHeard) {
  const test::TempDir folder;
  const std::string dir = folder.path() / "ca";
  const auto now = static_cast<int64_t>(std::time(nullptr));
  ASSERT_TRUE(make_authority_folder(dir, "farm", 30, now));
  ASSERT_TRUE(issue(dir, {"farm1", {Role::kCoordinator}, {"127.0.0.1"}, 30}, folder.path() / "farm1", now));
  ASSERT_TRUE(issue(dir, {"render7", {Role::kWorker}, {}, 30}, folder.path() / "render7", now));
  ASSERT_TRUE(issue(dir, {"ada", {Role::kRead}, {}, 30}, folder.path() / "ada", now));
  const auto tls = *TlsContext::load(tls_files_in(folder.path() / "farm1"));
  TestServer server(0, tls);
  server.plan.tls = tls_files_in(folder.path() / "ada");
  Talk::revocations = [tls] {
    const auto extent = tls->revocations();
    return text(", \"revoked_lists\": {}, \"revoked_serials\": {}", extent.files, extent.serials);
  };
  EXPECT_TRUE(examine(server.plan).back().good) << "a coordinator's folder begins with a list";
  server.plan.authority = dir;
  EXPECT_TRUE(examine(server.plan).back().good) << examine(server.plan).back().finding;
  ASSERT_TRUE(revoke(dir, "render7", now));
  expect_end(examine(server.plan), "revocations", "list is older: it has 0");
  std::filesystem::copy_file(dir + "/revoked", folder.path() / "farm1/revoked",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_TRUE(examine(server.plan).back().good) << examine(server.plan).back().finding;
  server.plan.authority = folder.path() / "none";
  expect_end(examine(server.plan), "revocations", "none/revoked");
  Talk::revocations = [] { return std::string(", \"revoked_lists\": 0, \"revoked_serials\": 0"); };
  expect_end(examine(server.plan), "revocations", "reads no list");
  Talk::revocations = nullptr;
}

TEST(Doctor, ThisMachine) {
  const test::TempDir folder;
  DoctorPlan plan;
  plan.worker_program = "/bin/echo";
  plan.data = folder.path() / "none";
  expect_end(examine(plan), "data folder", "is not a folder");
  if (::geteuid() != 0) {
    plan.data = folder.path();
    ::chmod(folder.path().c_str(), 0500);
    expect_end(examine(plan), "data folder", "");
    ::chmod(folder.path().c_str(), 0700);
  }
  plan.data = folder.path();
  ::chmod(folder.path().c_str(), 0755);
  expect_end(examine(plan), "data folder", "others may look into it: its mode is 755");
  ::chmod(folder.path().c_str(), 0700);
  plan.worker_program = "/bin/false";
  expect_end(examine(plan), "numeric class", "/bin/false");
  plan.worker_program = "/bin/echo";
  EXPECT_TRUE(examine(plan).back().good) << examine(plan).back().finding;
}

}  // namespace
}  // namespace kiln
