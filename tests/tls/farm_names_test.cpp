// Names and owners on a farm with certificates.
#include "tests/farm/farm_support.h"
#include "tests/tls/certified_peer.h"
#include "tests/tls/tls_pair.h"

namespace kiln::test {
namespace {

TEST(FarmNames, AreTheCertificatesAndNotWhatTheProgramStates) {
  Farm authority;
  FarmSettings settings;
  settings.local_workers = 0;
  settings.tls = authority.coordinator();
  settings.others_may_come = true;
  const auto farm = kiln::Farm::start(settings);
  ASSERT_TRUE(farm) << farm.error().message;
  CertifiedPeer worker((*farm)->port(), authority.worker());
  worker.send(Hello{"test", "", "render1", 17, 1, 2, "avx2", "none"});
  ASSERT_TRUE(worker.next<Welcome>()) << worker.end();
  const FarmStatus status = (*farm)->status();
  ASSERT_EQ(status.workers.size(), 1u);
  EXPECT_EQ(status.workers[0].name, "worker 1 (render7, host render1, process 17)");
  EXPECT_EQ(status.workers[0].identity, "render7");
  EXPECT_EQ(status.workers[0].owner, "render7");
  EXPECT_SAYS((*farm)->why_worker("render7").at(0), "render7");
  EXPECT_SAYS((*farm)->why_worker("render1").at(0), "no worker render1");
}

}  // namespace
}  // namespace kiln::test
