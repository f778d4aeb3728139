// In whose name a worker answers, without certificates.
#include "tests/farm/farm_support.h"
#include "tests/farm/raw_peer.h"

namespace kiln {
namespace {

using namespace test;

TEST(WorkerOwner, IsTheHolderOfATokenOfTheirOwnAndNobodyWithTheSharedOne) {
  FarmSettings settings;
  settings.local_workers = 0;
  settings.token = "the token of all";
  settings.owner_tokens = {{"ada", "the token of ada"}, {"bob", ""}};
  settings.others_may_come = true;
  const auto farm = Farm::start(settings);
  ASSERT_TRUE(farm) << farm.error().message;
  std::vector<RawPeer> peers;
  uint64_t instance = 0;
  for (const char* token : {"the token of all", "the token of ada", "the token of ada"}) {
    peers.push_back(RawPeer::connect((*farm)->port()));
    peers.back().send(Hello{"test", token, "bob", 1, ++instance, 1, "avx2", "none"});
    ASSERT_TRUE(peers.back().next<Welcome>()) << token;
  }
  for (const char* token : {"", "ada", "the token of bob"}) {
    RawPeer stranger = RawPeer::connect((*farm)->port());
    stranger.send(Hello{"test", token, "bob", 1, ++instance, 1, "avx2", "none"});
    const auto refused = stranger.next<Refused>();
    ASSERT_TRUE(refused) << token;
    EXPECT_NE(refused->reason.find("the token is not this coordinator's"), std::string::npos);
  }
  std::vector<std::string> owners;
  for (const WorkerStatus& worker : (*farm)->status().workers) owners.push_back(worker.owner);
  EXPECT_EQ(owners, (std::vector<std::string>{"", "ada", "ada"}));
}

}  // namespace
}  // namespace kiln
