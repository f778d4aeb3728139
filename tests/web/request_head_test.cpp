#include "coordinator/farm/web/request_head.h"

namespace kiln {
namespace {

int status(const std::string& head) {
  const auto parsed = parse_request_head(head);
  return parsed ? 200 : parsed.error().status;
}

TEST(RequestHead, TakesWhatAReaderSends) {
  const auto head = parse_request_head(
      "GET /api/jobs/3.json?x=%2e%2e HTTP/1.1\r\nHOST: render1:80\r\nAuthorization:  Bearer ab \r\nAccept: "
      "*/*\r\n\r\n");
  ASSERT_TRUE(head);
  EXPECT_EQ(head->path, "/api/jobs/3.json");
  EXPECT_EQ(head->host, "render1:80");
  EXPECT_EQ(head->authorization, "Bearer ab");
}

TEST(RequestHead, RefusesTheRest) {
  const auto of_path = [](const std::string& path) { return status("GET " + path + " HTTP/1.1\r\n\r\n"); };
  for (const char* path : {"", "*", "x", "/../etc/passwd", "/a/..", "/%2e%2e/", "/\\", "/a%00", "http://x/"})
    EXPECT_EQ(of_path(path), 400) << path;
  const auto of_header = [](const std::string& line) {
    return status("GET / HTTP/1.1\r\n" + line + "\r\n\r\n");
  };
  for (const std::string line :
       {"Host", ": x", "A b: c", " folded", "Host: a\nb", "Host: a\rb", "X: a\x01", "Host : x"})
    EXPECT_EQ(of_header(line), 400) << line;
  EXPECT_EQ(of_header("Host: a\r\nhost: b"), 400);
  EXPECT_EQ(of_header("Content-Length: 5"), 413);
  EXPECT_EQ(of_header("Content-Length: 0"), 200);
  EXPECT_EQ(of_header("Transfer-Encoding: chunked"), 413);
  for (const char* method : {"POST", "PUT", "DELETE", "HEAD", "OPTIONS", "TRACE", "CONNECT", "get", ""})
    EXPECT_EQ(status(std::string(method) + " / HTTP/1.1\r\n\r\n"), 405) << method;
  EXPECT_EQ(status("GET / HTTP/2.0\r\n\r\n"), 505);
  EXPECT_EQ(status("GET / HTTP/1.1 x\r\n\r\n"), 505);
  EXPECT_EQ(status("GET /\r\n\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x"), 400);
  EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/1.1"), 400);
  EXPECT_EQ(status(""), 400);
  EXPECT_EQ(status(std::string(2, '\0') + "\r\n\r\n"), 400);
}

TEST(RequestHead, ComesInPieces) {
  const std::string head = "GET /a HTTP/1.1\r\nHost: x\r\n\r\n";
  HeadCollector bytes;
  for (size_t i = 0; i + 1 < head.size(); ++i) ASSERT_FALSE(bytes.add(head.substr(i, 1))) << i;
  const auto whole = bytes.add(head.substr(head.size() - 1) + "GET /next");
  ASSERT_TRUE(whole && *whole);
  EXPECT_EQ((*whole)->path, "/a");
  HeadCollector endless;
  size_t taken = 0;
  while (!endless.add("a") && taken < 2 * kMaxHeadBytes) ++taken;
  EXPECT_EQ(taken, kMaxHeadBytes);
  HeadCollector large;
  const auto refused = large.add("GET / HTTP/1.1\r\nX: " + std::string(kMaxHeadBytes, 'x') + "\r\n\r\n");
  ASSERT_TRUE(refused && !*refused);
  EXPECT_EQ(refused->error().status, 431);
}

}  // namespace
}  // namespace kiln
