// kiln fetch against a coordinator that names its results as it likes.
#include <filesystem>

#include "common/base/format.h"
#include "common/wire/limits.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/farm/dispatch/farm.h"

namespace kiln {
namespace {

class Talk final : public ClientTalk {
 public:
  Talk(ClientLink& link, const std::string& reply) : link_(link), reply_(reply) {}
  std::string role() const override { return "submit"; }
  uint32_t max_message_bytes() const override { return kMaxDataBytes; }
  void on_request(Request request) override {
    link_.send(Reply{request.id, true, ErrorKind::kInternal, reply_});
  }
  void on_piece(ChunkPiece) override {}
  Status on_chunk_request(ChunkRequest) override { return {}; }
  void on_room() override {}

 private:
  ClientLink& link_;
  const std::string& reply_;
};

TEST(Fetch, RefusesNamesThatAreNone) {
  std::string reply;
  FarmSettings settings;
  settings.local_workers = 0;
  settings.clients.admit = [&reply](const ClientHello&, const PeerIdentity&,
                                    ClientLink& link) -> Expected<std::unique_ptr<ClientTalk>> {
    return std::make_unique<Talk>(link, reply);
  };
  const auto farm = Farm::start(settings);
  ASSERT_TRUE(farm) << farm.error().message;
  const test::TempDir dir;
  for (const std::string name : {"../x", "/etc/passwd", ".hidden", "", "a\nb", "\x1b[2J", "a\x7f",
                                 "\xc2\x9b"
                                 "2J"}) {
    reply =
        text(R"({{"files":[{{"path":{},"digest":"{}","size":1}}]}})", json_quote(name), std::string(64, '0'));
    ClientOptions options;
    options.server = text("127.0.0.1:{}", (*farm)->port());
    auto client = ServiceClient::connect(options);
    ASSERT_TRUE(client) << client.error().message;
    const Status s = fetch_results(**client, 1, dir.path() / "out", true);
    ASSERT_FALSE(s);
    EXPECT_NE(s.error().message.find("which is not a file name"), std::string::npos) << s.error().message;
    for (const char c : s.error().message) EXPECT_TRUE(static_cast<unsigned char>(c) >= 32) << name;
    EXPECT_TRUE(std::filesystem::is_empty(dir.path() / "out")) << name;
  }
}

}  // namespace
}  // namespace kiln
