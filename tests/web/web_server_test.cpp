#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>

#include "common/base/clock.h"
#include "tests/web/web_support.h"

namespace kiln {
namespace {

using test::content_of;
using test::get;
using test::say;
using test::status_of;

std::unique_ptr<WebServer> serve(const test::FakeFarm& fake, WebSettings settings = {}) {
  auto server = WebServer::start(settings, fake.source());
  EXPECT_TRUE(server);
  return std::move(*server);
}

TEST(WebServer, AnswersWhatItHas) {
  const test::FakeFarm fake;
  const auto server = serve(fake);
  EXPECT_EQ(status_of(get(server->port(), "/healthz")), 200);
  const std::string metrics = get(server->port(), "/metrics");
  EXPECT_NE(metrics.find("Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n"), metrics.npos);
  EXPECT_NE(metrics.find("\nkiln_results_total 913\n"), metrics.npos);
  const std::string status = get(server->port(), "/api/status.json");
  EXPECT_NE(status.find("Content-Type: application/json\r\n"), status.npos);
  EXPECT_NE(status.find("\"days_until_full\": 20"), status.npos) << status;
  const std::string workers = get(server->port(), "/api/workers.json");
  EXPECT_NE(workers.find("\"identity\": \"render7\""), workers.npos) << workers;
  EXPECT_NE(get(server->port(), "/api/jobs.json?since=3").find("\"state\": \"baking\""), std::string::npos);
  const std::string job = get(server->port(), "/api/jobs/2.json");
  EXPECT_EQ(status_of(job), 200);
  EXPECT_NE(job.find("render7 joined"), job.npos);
  for (const char* path :
       {"/api/jobs/9.json", "/api/jobs/.json", "/api/jobs/2x.json", "/api/jobs/-2.json",
        "/api/jobs/99999999999999999999.json", "/api/jobs/2", "/metrics/", "/index.html", "/api"})
    EXPECT_EQ(status_of(get(server->port(), path)), 404) << path;
}

TEST(WebServer, HealthFollowsTheStore) {
  test::FakeFarm fake;
  fake.health.held_for = "no space is left on the disk";
  const auto server = serve(fake);
  const std::string answer = get(server->port(), "/healthz");
  EXPECT_EQ(status_of(answer), 503);
  EXPECT_NE(content_of(answer).find("no space is left"), std::string::npos);
}

TEST(WebServer, ThePageLoadsNothingAndTrustsNothing) {
  const test::FakeFarm fake;
  const auto server = serve(fake);
  const std::string page = get(server->port(), "/");
  EXPECT_EQ(status_of(page), 200);
  const size_t at = page.find("script-src 'nonce-");
  ASSERT_NE(at, page.npos);
  const std::string nonce = page.substr(at + 18, 32);
  EXPECT_NE(page.find("<script nonce=\"" + nonce + "\">"), page.npos);
  EXPECT_NE(page.find("default-src 'none'"), page.npos);
  EXPECT_EQ(get(server->port(), "/").find(nonce), std::string::npos) << "a nonce is used once";
  for (const char* danger : {"innerHTML", "http://", "https://", "eval(", "unsafe-inline", "src="})
    EXPECT_EQ(page.find(danger), page.npos) << danger;
}

TEST(WebServer, HostileRequestsAreRefusedInWords) {
  const test::FakeFarm fake;
  WebSettings settings;
  settings.limits.patience = std::chrono::milliseconds(300);
  const auto server = serve(fake, settings);
  const uint16_t port = server->port();
  EXPECT_EQ(status_of(say(port, "POST / HTTP/1.1\r\nContent-Length: 1000000000\r\n\r\n")), 405);
  EXPECT_EQ(status_of(say(port, "GET / HTTP/1.1\r\nContent-Length: 7\r\n\r\nabc")), 413);
  EXPECT_EQ(status_of(get(port, "/../../etc/passwd")), 400);
  EXPECT_EQ(status_of(get(port, "/%2e%2e/%2e%2e/etc/passwd")), 400);
  EXPECT_EQ(status_of(say(port, std::string("\x16\x03\x01\x02\x00\r\n\r\n", 9))), 400)
      << "a hand-shake of TLS";
  EXPECT_EQ(status_of(get(port, "/", "X: " + std::string(9000, 'a') + "\r\n")), 431);
  std::string many;
  for (int i = 0; i < 2000; ++i) many += "A" + std::to_string(i) + ": b\r\n";
  EXPECT_EQ(status_of(get(port, "/", many)), 431);
  EXPECT_EQ(status_of(get(port, "/metrics", "Range: bytes=0-,0-,0-\r\nAccept-Encoding: gzip\r\n")), 200);
  EXPECT_EQ(status_of(say(port, "GET / HTTP/1.1\r\nHost: x")), 408) << "a head that never ends";
  EXPECT_EQ(status_of(say(port, "")), 408);
  EXPECT_EQ(status_of(get(port, "/healthz")), 200);
}

TEST(WebServer, WithoutATokenItSpeaksToThisMachineOnly) {
  const test::FakeFarm fake;
  const auto server = serve(fake);
  EXPECT_EQ(status_of(say(server->port(), "GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n")), 421);
  EXPECT_EQ(status_of(say(server->port(), "GET /metrics HTTP/1.1\r\n\r\n")), 421);
  EXPECT_EQ(status_of(say(server->port(), "GET /metrics HTTP/1.1\r\nHost: [::1]:80\r\n\r\n")), 200);
  EXPECT_EQ(status_of(say(server->port(), "GET /metrics HTTP/1.1\r\nHost: 127.0.0.1:80\r\n\r\n")), 200);
  for (const char* host : {"127.evil.example", "[::1].evil.example", "127.0.0.1.evil", "localhost.evil",
                           "127.evil.example:80", "localhost:", "localhost:80x"})
    EXPECT_EQ(
        status_of(say(server->port(), std::string("GET /metrics HTTP/1.1\r\nHost: ") + host + "\r\n\r\n")),
        421)
        << host;
  WebSettings abroad;
  abroad.host = "127.evil.example";
  EXPECT_FALSE(WebServer::start(abroad, fake.source())) << "it may resolve to any address";
  abroad.host = "0.0.0.0";
  EXPECT_FALSE(WebServer::start(abroad, fake.source()));
  abroad.beyond_loopback = true;
  EXPECT_FALSE(WebServer::start(abroad, fake.source())) << "a token is needed too";
}

TEST(WebServer, ATokenIsAskedForAllButHealthAndTheEmptyPage) {
  test::FakeFarm fake;
  fake.health.held_for = "the disk /srv/kiln is full";
  WebSettings settings;
  settings.host = "0.0.0.0";
  settings.beyond_loopback = true;
  settings.token = "s3cret";
  const auto server = serve(fake, settings);
  const uint16_t port = server->port();
  for (const char* path : {"/metrics", "/api/status.json", "/api/jobs.json", "/api/workers.json",
                           "/api/jobs/1.json", "/nothing"}) {
    EXPECT_EQ(status_of(get(port, path)), 401) << path;
    EXPECT_EQ(status_of(get(port, path, "Authorization: Bearer s3cre\r\n")), 401) << path;
    EXPECT_EQ(status_of(get(port, path, "Authorization: s3cret\r\n")), 401) << path;
  }
  EXPECT_EQ(status_of(get(port, "/metrics", "Authorization: Bearer s3cret\r\n")), 200);
  const std::string stranger = get(port, "/healthz");
  EXPECT_EQ(status_of(stranger), 503);
  EXPECT_EQ(stranger.find("/srv/kiln"), stranger.npos) << "names are for those with the token";
  EXPECT_NE(get(port, "/healthz", "Authorization: Bearer s3cret\r\n").find("/srv/kiln"), std::string::npos);
  // Names that the page's nonce, 32 random hexadecimal digits, cannot contain by chance.
  const std::string page = get(port, "/");
  EXPECT_EQ(status_of(page), 200);
  for (const char* name : {"arcade", "render7", "harbour"}) EXPECT_EQ(page.find(name), page.npos) << name;
}

// Connected, from 127.0.0.LAST.
int connect_to(uint16_t port, uint32_t last = 1) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl((127u << 24) + last);
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

void put(int fd, const std::string& bytes) {
  EXPECT_EQ(::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
}

std::string take(int fd) {
  std::string answer;
  char buffer[4096];
  for (ssize_t got = 0; (got = ::recv(fd, buffer, sizeof buffer, 0)) > 0;)
    answer.append(buffer, static_cast<size_t>(got));
  return answer;
}

// Idle, half-asked and not reading: hundreds of each, with a patience that ends long after the test.
TEST(WebServer, HundredsThatHangKeepNobodyOut) {
  test::FakeFarm fake;
  for (int i = 0; i < 100'000; ++i)
    fake.events.push_back({1700000000000 + i, "render7 has been heard again"});
  WebSettings settings;
  settings.limits.patience = std::chrono::hours(1);
  settings.threads = 2;
  settings.waiting = 8;
  const auto server = serve(fake, settings);
  const uint16_t port = server->port();
  const int neighbour = connect_to(port, 2);
  put(neighbour, "GET /metrics HTTP/1.1\r\n");
  std::vector<int> slow;
  for (int i = 0; i < 300; ++i) {
    slow.push_back(connect_to(port));
    if (i % 3 == 1) put(slow.back(), "GET / HTTP/1.1\r\nHost: loc");
  }
  EXPECT_EQ(status_of(get(port, "/healthz")), 200);
  EXPECT_EQ(status_of(get(port, "/api/status.json")), 200);
  for (int i = 0; i < 12; ++i) {
    slow.push_back(connect_to(port));
    put(slow.back(),
        "GET /api/jobs/2.json HTTP/1.1\r\nHost: localhost\r\n\r\n");  // and never reads the answer
    if (i % 4 == 3) EXPECT_EQ(status_of(get(port, "/readyz")), 200);
  }
  EXPECT_EQ(status_of(get(port, "/healthz")), 200);
  EXPECT_EQ(status_of(get(port, "/api/jobs.json")), 200);
  EXPECT_EQ(status_of(take(slow[0])), 503) << "the oldest gave way, and is told so";
  put(neighbour, "Host: localhost\r\n\r\n");
  EXPECT_EQ(status_of(take(neighbour)), 200) << "one address takes no room from another";
  for (const int fd : slow) ::close(fd);
  ::close(neighbour);
}

TEST(WebServer, ManyAddressesTogetherHaveABoundToo) {
  const test::FakeFarm fake;
  WebSettings settings;
  settings.limits = {std::chrono::hours(1), 20, 4};
  const auto server = serve(fake, settings);
  std::vector<int> idle;
  for (uint32_t i = 0; i < 100; ++i) idle.push_back(connect_to(server->port(), 1 + i / 2));
  EXPECT_EQ(status_of(get(server->port(), "/healthz")), 200);
  int told = 0;
  for (size_t i = 0; i < 80; ++i) told += status_of(take(idle[i])) == 503;
  EXPECT_EQ(told, 80);
  for (const int fd : idle) ::close(fd);
}

// A program that a liveness probe restarts must be unable to answer; a full disk or a slow farm is not that.
TEST(WebServer, IsAliveWhileItIsNotReady) {
  test::FakeFarm fake;
  fake.health.held_for = "no space is left on the disk";
  std::promise<void> go_on;
  const std::shared_future<void> stuck = go_on.get_future().share();
  FarmSource source = fake.source();
  source.farm = [&, stuck] {
    stuck.wait();
    return fake.farm;
  };
  WebSettings settings;
  settings.threads = 1;
  settings.waiting = 1;
  const auto server = std::move(*WebServer::start(settings, source));
  const uint16_t port = server->port();
  EXPECT_EQ(status_of(get(port, "/livez")), 200);
  EXPECT_EQ(status_of(get(port, "/readyz")), 503);
  EXPECT_EQ(status_of(get(port, "/healthz")), 503);
  std::vector<int> waiting;
  for (int i = 0; i < 4; ++i) {
    waiting.push_back(connect_to(port));
    put(waiting.back(), "GET /api/status.json HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  EXPECT_EQ(content_of(get(port, "/livez")), "ok\n") << "every thread waits for the farm";
  EXPECT_EQ(status_of(say(port, "GET /livez HTTP/1.0\r\n\r\n")), 200) << "probes name no host";
  go_on.set_value();
  int answered = 0;
  for (const int fd : waiting) {
    answered += status_of(take(fd)) == 200;
    ::close(fd);
  }
  EXPECT_GE(answered, 1);
  EXPECT_LE(answered, 2) << "one in its thread and one waiting; the others are told to come back";
}

TEST(WebServer, ATakenPortIsAnError) {
  const test::FakeFarm fake;
  const auto server = serve(fake);
  WebSettings same;
  same.port = server->port();
  const auto second = WebServer::start(same, fake.source());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another program has the port"), std::string::npos);
}

// KILN_SERVE_PAGE=SECONDS: keeps a server on port 7801, to be looked at.
TEST(WebServer, ServesThePageToBeLookedAt) {
  const char* seconds = std::getenv("KILN_SERVE_PAGE");
  if (!seconds) GTEST_SKIP() << "set KILN_SERVE_PAGE=60 and open http://localhost:7801";
  test::FakeFarm fake;
  WebSettings settings;
  settings.port = 7801;
  const auto server = serve(fake, settings);
  ::sleep(static_cast<unsigned>(std::atoi(seconds)));
}

}  // namespace
}  // namespace kiln
