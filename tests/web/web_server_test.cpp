#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/base/clock.h"
#include "tests/web/web_support.h"

namespace kiln {
namespace {

using test::content_of;
using test::get;
using test::say;
using test::status_of;

std::unique_ptr<WebServer> serve(const test::FakeFarm& fake, WebSettings settings = {}) {
  auto server = WebServer::start(settings, fake.sources());
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
  EXPECT_NE(status.find("\"identity\": \"render7\""), status.npos) << status;
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
  fake.store.held_for = "no space is left on the disk";
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
  settings.patience = std::chrono::milliseconds(300);
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
  EXPECT_FALSE(WebServer::start(abroad, fake.sources())) << "it may resolve to any address";
  abroad.host = "0.0.0.0";
  EXPECT_FALSE(WebServer::start(abroad, fake.sources()));
  abroad.beyond_loopback = true;
  EXPECT_FALSE(WebServer::start(abroad, fake.sources())) << "a token is needed too";
}

TEST(WebServer, ATokenIsAskedForAllButHealthAndTheEmptyPage) {
  test::FakeFarm fake;
  fake.store.held_for = "the disk /srv/kiln is full";
  WebSettings settings;
  settings.host = "0.0.0.0";
  settings.beyond_loopback = true;
  settings.token = "s3cret";
  const auto server = serve(fake, settings);
  const uint16_t port = server->port();
  for (const char* path :
       {"/metrics", "/api/status.json", "/api/jobs.json", "/api/jobs/1.json", "/nothing"}) {
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

TEST(WebServer, SlowPeersDoNotKeepOthersOut) {
  const test::FakeFarm fake;
  WebSettings settings;
  settings.patience = std::chrono::seconds(60);
  settings.threads = 2;
  settings.waiting = 8;
  const auto server = serve(fake, settings);
  std::vector<int> slow;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(server->port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int i = 0; i < 12; ++i) {
    slow.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    ASSERT_EQ(::connect(slow.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  // Two have a thread, eight wait, the rest are told so at once.
  EXPECT_EQ(status_of(get(server->port(), "/healthz")), 503);
  EXPECT_EQ(status_of(say(server->port(), "")), 503);
  for (const int fd : slow) ::close(fd);
  std::string answer;
  for (int i = 0; i < 100 && status_of(answer) != 200; ++i) {
    ::usleep(100000);
    answer = get(server->port(), "/healthz");
  }
  EXPECT_EQ(status_of(answer), 200) << "when the slow ones have gone";
}

TEST(WebServer, ATakenPortIsAnError) {
  const test::FakeFarm fake;
  const auto server = serve(fake);
  WebSettings same;
  same.port = server->port();
  const auto second = WebServer::start(same, fake.sources());
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
