// kiln view: what it serves, what it does not, and what it says of a folder that cannot be shown.
#include "coordinator/viewer/view_server.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/base/files.h"
#include "coordinator/viewer/served_files.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

// A folder to show, and viewer files to show it with.
struct Stage {
  test::TempDir dir;
  fs::path bake = dir.path() / "bake", share = dir.path() / "share";
  Stage() {
    const fs::path three = share / "examples/three/node_modules/three/build";
    for (const fs::path& folder : {bake / "sub", three, share / "shaders"}) fs::create_directories(folder);
    write(bake / "scene.glb", "0123456789");
    write(bake / "sub/a b.exr", "inner");
    write(bake / "empty.json", "");
    write(bake / ".secret", "hidden");
    write(dir.path() / "outside.txt", "outside");
    fs::create_symlink(dir.path() / "outside.txt", bake / "link.txt");
    fs::create_directory_symlink(dir.path(), bake / "up");
    write(share / "examples/three/index.html", "<p>page");
    write(share / "shaders/kiln_lightmap.glsl", "void");
    write(three / "three.module.js", "export");
  }
  static void write(const fs::path& path, std::string_view text) {
    ASSERT_TRUE(write_file_atomic(path, text));
  }
  ViewSettings settings(uint16_t port = 0) const { return {bake, share, port}; }
};

std::string say(uint16_t port, const std::string& request) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    (void)!::send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    char buffer[4096];
    for (ssize_t got; (got = ::recv(fd, buffer, sizeof buffer, 0)) > 0;)
      answer.append(buffer, static_cast<size_t>(got));
  }
  ::close(fd);
  return answer;
}

class ViewServerTest : public testing::Test {
 protected:
  void SetUp() override {
    auto started = ViewServer::start(stage_.settings());
    ASSERT_TRUE(started) << started.error().message;
    server_ = std::move(*started);
  }
  std::string ask(const std::string& path, const std::string& headers = "", const std::string& method = "GET",
                  const std::string& host = "localhost") {
    return say(server_->port(), method + " " + path + " HTTP/1.1\r\nHost: " + host + "\r\n" + headers +
                                    "Connection: close\r\n\r\n");
  }
  static int status(const std::string& answer) {
    return answer.size() > 12 ? std::stoi(answer.substr(9, 3)) : 0;
  }
  static std::string content(const std::string& answer) {
    const size_t end = answer.find("\r\n\r\n");
    return end == answer.npos ? "" : answer.substr(end + 4);
  }

  Stage stage_;
  std::unique_ptr<ViewServer> server_;
};

TEST_F(ViewServerTest, ServesTheFolderTheViewerAndTheShaders) {
  EXPECT_EQ(content(ask("/bake/scene.glb")), "0123456789");
  EXPECT_NE(ask("/bake/scene.glb").find("Content-Type: model/gltf-binary\r\n"), std::string::npos);
  EXPECT_EQ(content(ask("/bake/sub/a%20b.exr")), "inner");
  EXPECT_EQ(content(ask("/bake/scene.glb?version=2")), "0123456789");
  EXPECT_EQ(status(ask("/bake/empty.json")), 200);
  EXPECT_EQ(content(ask("/docs/examples/three/index.html")), "<p>page");
  EXPECT_EQ(content(ask("/docs/shaders/kiln_lightmap.glsl")), "void");
  const std::string module = ask("/docs/examples/three/node_modules/three/build/three.module.js");
  EXPECT_NE(module.find("Content-Type: text/javascript"), std::string::npos);
  const std::string root = ask("/");
  EXPECT_EQ(status(root), 302);
  EXPECT_NE(root.find("Location: /docs/examples/three/index.html?folder=/bake/\r\n"), std::string::npos);
}

TEST_F(ViewServerTest, SendsPartsAndHeads) {
  const std::string part = ask("/bake/scene.glb", "Range: bytes=2-4\r\n");
  EXPECT_EQ(status(part), 206);
  EXPECT_EQ(content(part), "234");
  EXPECT_NE(part.find("Content-Range: bytes 2-4/10\r\n"), std::string::npos);
  EXPECT_EQ(status(ask("/bake/scene.glb", "Range: bytes=0-1,3-4,6-7\r\n")), 416);
  const std::string head = ask("/bake/scene.glb", "", "HEAD");
  EXPECT_EQ(status(head), 200);
  EXPECT_NE(head.find("Content-Length: 10\r\n"), std::string::npos);
  EXPECT_EQ(content(head), "");
}

TEST_F(ViewServerTest, SendsLargeFilesInPieces) {
  std::string large(3 << 20, 'x');
  for (size_t i = 0; i < large.size(); i += 977) large[i] = static_cast<char>('a' + i % 26);
  Stage::write(stage_.bake / "large.exr", large);
  EXPECT_TRUE(content(ask("/bake/large.exr")) == large);
  EXPECT_TRUE(content(ask("/bake/large.exr", "Range: bytes=1000000-1099999\r\n")) ==
              large.substr(1000000, 100000));
}

TEST_F(ViewServerTest, LeavesNoFolder) {
  for (const char* path : {"/bake/../outside.txt", "/bake/%2e%2e/outside.txt", "/bake/sub/../../outside.txt",
                           "/bake//etc/passwd", "/bake/..%2foutside.txt", "/bake/.secret", "/bake/link.txt",
                           "/bake/up/outside.txt", "/bake/", "/bake/sub", "/bake/sub/", "/bake/a%00b",
                           "/bake/..%5coutside.txt", "/etc/passwd", "/docs/index.html", "/docs/examples/"}) {
    const std::string answer = ask(path);
    EXPECT_EQ(status(answer), 404) << path;
    EXPECT_EQ(answer.find("outside\n"), std::string::npos) << path;
    EXPECT_GT(content(answer).size(), 10u) << path;  // words, not a bare number
  }
  EXPECT_NE(content(ask("/bake/link.txt")).find("symbolic link"), std::string::npos);
}

TEST_F(ViewServerTest, ReadsAndNothingElseForThisMachineAlone) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    const std::string answer = ask("/bake/scene.glb", "Content-Length: 0\r\n", method);
    EXPECT_EQ(status(answer), 405) << method;
    EXPECT_NE(answer.find("Allow: GET, HEAD\r\n"), std::string::npos) << method;
  }
  EXPECT_EQ(status(ask("/bake/scene.glb", "", "GET", "attacker.example")), 421);
  for (const char* host :
       {"127.evil.example", "127.0.0.1.evil", "localhost.evil:80", "[::1].evil", "localhost:x"})
    EXPECT_EQ(status(ask("/bake/scene.glb", "", "GET", host)), 421) << host;
  EXPECT_EQ(status(ask("/bake/scene.glb", "", "GET", "127.0.0.1:99")), 200);
}

TEST_F(ViewServerTest, SaysThatThePortIsTaken) {
  const auto second = ViewServer::start(stage_.settings(server_->port()));
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("is taken"), std::string::npos) << second.error().message;
}

TEST(CheckView, SaysWhatIsMissing) {
  const auto message = [](const Stage& s) {
    const Status status = check_view(s.settings());
    return status ? std::string() : status.error().message;
  };
  const auto expect = [](const std::string& said, const std::string& part) {
    EXPECT_NE(said.find(part), std::string::npos) << said;
  };
  Stage s;
  EXPECT_EQ(message(s), "");
  fs::remove_all(s.share / "examples/three/node_modules");
  expect(message(s), "npm ci --prefix " + (s.share / "examples/three").string());
  fs::remove(s.share / "examples/three/index.html");
  expect(message(s), "KILN_SHARE");
  fs::remove(s.bake / "scene.glb");
  expect(message(s), "holds no scene.glb");
  fs::remove_all(s.bake);
  expect(message(s), "is not a folder");
}

TEST(ViewCommand, EndsWithTwoOnWrongUse) {
  const std::string kiln = "'" + (test::binary_dir() / "bin/kiln").string() + "' view ";
  for (const auto& [arguments, part] :
       {std::pair("/nowhere/at/all", "is not a folder"), std::pair("", "folder"),
        std::pair("/tmp --port 99999", "--port"), std::pair("/tmp --port x", "--port")}) {
    const auto result = test::run_command("timeout 10 " + kiln + arguments);
    EXPECT_EQ(result.exit_status, 2) << result.output;
    EXPECT_NE(result.output.find(part), std::string::npos) << result.output;
  }
}

}  // namespace
}  // namespace kiln
