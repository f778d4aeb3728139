// Certificates that are revoked while they are in use.
#include <atomic>
#include <fstream>
#include <thread>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/responses/quantities.h"
#include "common/wire/limits.h"
#include "tests/farm/farm_support.h"
#include "tests/farm/stub_bake.h"
#include "tests/tls/certified_peer.h"
#include "tests/tls/tls_pair.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& words) {
  ASSERT_TRUE(write_file_atomic(file, std::string_view(words)));
}

struct Lists : testing::Test {
  TempDir dir;
  fs::path one = dir.path() / "one", two = dir.path() / "two";
  // What was logged since the last call.
  std::string log() {
    std::string words = testing::internal::GetCapturedStderr();
    testing::internal::CaptureStderr();
    return words;
  }
  Lists() { testing::internal::CaptureStderr(); }
  ~Lists() override { (void)testing::internal::GetCapturedStderr(); }
};

TEST_F(Lists, CountTogetherAndAreReadAgainWhenTheyChange) {
  const RevocationLists lists({one, two, one});
  EXPECT_FALSE(*lists.contains("aa"));
  EXPECT_EQ(lists.extent().files, 0u);
  write(two, "aa\n");
  EXPECT_TRUE(*lists.contains("aa"));
  write(one, "bb\n");
  EXPECT_TRUE(*lists.contains("bb"));
  EXPECT_FALSE(*lists.contains("cc"));
  std::ofstream(one, std::ios::app) << "cc\n";  // in place
  EXPECT_TRUE(*lists.contains("cc"));
  EXPECT_EQ(lists.extent().files, 2u);
  EXPECT_EQ(lists.extent().serials, 3u);
  EXPECT_EQ(log(), "");
}

TEST_F(Lists, ThatAreDamagedCutShortOrGoneLetNobodyBackIn) {
  const RevocationLists lists({one});
  write(one, "aa\nbb\n");
  EXPECT_TRUE(*lists.contains("bb"));
  write(one, "aa\nwhat is this\n");
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(*lists.contains("bb"));
    EXPECT_FALSE(*lists.contains("cc")) << "the last good list counts";
  }
  const std::string damaged = log();
  EXPECT_SAYS(damaged, "line 2 is not a serial number");
  EXPECT_SAYS(damaged, "its last good state counts until it is mended");
  EXPECT_EQ(damaged.find("line 2"), damaged.rfind("line 2")) << "said once: " << damaged;
  write(one, "aa\n");
  EXPECT_TRUE(*lists.contains("bb"));
  EXPECT_SAYS(log(), "serials have gone from the list");
  fs::remove(one);
  EXPECT_TRUE(*lists.contains("aa"));
  EXPECT_TRUE(*lists.contains("bb"));
  EXPECT_SAYS(log(), "cannot be read: No such file");
  write(one, "cc\n");
  EXPECT_TRUE(*lists.contains("cc"));
  EXPECT_TRUE(*lists.contains("aa"));
}

TEST_F(Lists, ThatWereNeverReadableLetNobodyIn) {
  write(one, "what is this\n");
  const RevocationLists lists({one, two});
  EXPECT_FALSE(lists.contains("aa"));
  EXPECT_SAYS(log(), "nobody is let in until it is mended");
  write(two, "aa\n");
  EXPECT_TRUE(*lists.contains("aa"));
  EXPECT_FALSE(lists.contains("bb"));
  write(one, "");
  EXPECT_FALSE(*lists.contains("bb"));
}

class Talk final : public ClientTalk {
 public:
  Talk(ClientLink& link, std::atomic<int>& requests) : link_(link), requests_(requests) {}
  std::string role() const override { return "submit"; }
  uint32_t max_message_bytes() const override { return kMaxDataBytes; }
  void on_request(Request request) override {
    ++requests_;
    link_.send(Reply{request.id, true, ErrorKind::kInternal, "{}"});
  }
  void on_piece(ChunkPiece) override {}
  Status on_chunk_request(ChunkRequest) override { return {}; }
  void on_room() override {}

 private:
  ClientLink& link_;
  std::atomic<int>& requests_;
};

// A farm with certificates that bakes one unit, and waits half a minute for it.
struct Revocation : testing::Test {
  void SetUp() override {
    FarmSettings settings;
    settings.local_workers = 0;
    settings.tls = authority_.coordinator();
    settings.others_may_come = true;
    settings.rules.lease_ms = 600'000;  // no unit goes back because its lease ends
    settings.clients.admit = [this](const ClientHello&, const PeerIdentity&,
                                    ClientLink& link) -> Expected<std::unique_ptr<ClientTalk>> {
      return std::make_unique<Talk>(link, requests_);
    };
    auto started = start_farm(settings, job_);
    ASSERT_TRUE(started) << started.error().message;
    farm_ = std::move(*started);
    pass_ = std::thread([this] {
      const auto keep = [this](const WorkUnit&, const UnitResult& result) -> Status {
        rays_ = result.rays;
        return {};
      };
      end_ = farm_.job->run_pass(make_units(1, 1), SteadyClock().now_ms() + 30'000, {keep, {}, {}});
    });
  }
  void TearDown() override {
    if (pass_.joinable()) pass_.join();
  }
  std::shared_ptr<const TlsContext> certificate(const std::string& name, Role role) {
    return authority_.context(name, {role});
  }
  void revoke(const TlsContext& whose) {
    write(authority_.ca_dir() / "revoked", whose.own().identity.serial + "\n");
  }
  // A worker that is ready for a unit.
  std::unique_ptr<CertifiedPeer> worker(std::shared_ptr<const TlsContext> tls, uint64_t instance) {
    auto peer = std::make_unique<CertifiedPeer>(farm_.farm->port(), std::move(tls));
    peer->send(Hello{"test", "", "host", 1, instance, 1, "avx2", "none"});
    EXPECT_TRUE(peer->next<Welcome>());
    peer->send(JobClass{job_.spec.id, "class"});
    peer->send(Credits{job_.spec.id, 1});
    return peer;
  }
  static Result answer(const Unit& unit, uint64_t rays) {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    Result r{unit.job, unit.lease, stub_bake(unit.unit, planes), {}};
    r.result.rays = rays;
    r.digest = result_digest(r.result);
    return r;
  }

  test::Farm authority_;
  const TestJob job_;
  std::atomic<int> requests_{0};
  TestFarm farm_;
  std::thread pass_;
  Expected<PassEnd> end_ = PassEnd::kTimeUp;
  uint64_t rays_ = 0;
};

TEST_F(Revocation, CutsAWorkerWhoseUnitsGoToAnother) {
  const auto stolen = certificate("render7", Role::kWorker);
  const auto thief = worker(stolen, 1);
  const auto unit = thief->next<Unit>();
  ASSERT_TRUE(unit);
  revoke(*stolen);
  thief->send(answer(*unit, 666));
  EXPECT_SAYS(thief->next<Refused>().value_or(Refused{"(not refused)"}).reason,
              "the certificate of render7 (serial " + stolen->own().identity.serial + ") was revoked");
  const auto honest = worker(certificate("render8", Role::kWorker), 2);
  const auto again = honest->next<Unit>();
  ASSERT_TRUE(again) << "the unit of a revoked worker goes back at once";
  EXPECT_EQ(again->unit.id, unit->unit.id);
  honest->send(answer(*again, 7));
  EXPECT_TRUE(honest->next<CommitAck>());
  pass_.join();
  ASSERT_TRUE(end_);
  EXPECT_EQ(*end_, PassEnd::kComplete);
  EXPECT_EQ(rays_, 7u) << "nothing that came after the revocation counts";
  CertifiedPeer back(farm_.farm->port(), stolen);
  EXPECT_SAYS(back.end(), "revoked");
}

TEST_F(Revocation, CutsAWorkerThatSaysNothing) {
  const auto stolen = certificate("render7", Role::kWorker);
  const auto idle = worker(stolen, 1);
  ASSERT_TRUE(idle->next<Unit>());
  revoke(*stolen);
  EXPECT_SAYS(idle->end(), "");
  EXPECT_TRUE(farm_.farm->status().workers.empty());
  const auto other = worker(certificate("render8", Role::kWorker), 2);
  const auto unit = other->next<Unit>();
  ASSERT_TRUE(unit);
  other->send(answer(*unit, 1));
  EXPECT_TRUE(other->next<CommitAck>());
}

TEST_F(Revocation, CutsAPersonsProgram) {
  const auto stolen = certificate("ada", Role::kSubmit);
  CertifiedPeer ada(farm_.farm->port(), stolen);
  ada.send(ClientHello{"test", "", "ada", "host"});
  ASSERT_TRUE(ada.next<ClientWelcome>());
  ada.send(Request{1, "jobs", "{}"});
  ASSERT_TRUE(ada.next<Reply>());
  revoke(*stolen);
  ada.send(Request{2, "jobs", "{}"});
  EXPECT_SAYS(ada.next<Refused>().value_or(Refused{"(not refused)"}).reason, "ada");
  EXPECT_EQ(requests_, 1);
  const auto other = worker(certificate("render8", Role::kWorker), 2);
  const auto unit = other->next<Unit>();
  ASSERT_TRUE(unit) << "the others stay";
  other->send(answer(*unit, 1));
  EXPECT_TRUE(other->next<CommitAck>());
}

}  // namespace
}  // namespace kiln::test
