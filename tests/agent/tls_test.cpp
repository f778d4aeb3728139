// A worker process that shows the certificate of a farm's authority.
#include <chrono>

#include "tests/farm/worker_process.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {

using namespace test;

std::vector<std::string> arguments_of(const TlsFiles& files) {
  return {"--ca", files.ca.string(), "--certificate", files.certificate.string(), "--key", files.key.string()};
}

void run_until_it_ends(TlsPair& pair, WorkerProcess& worker) {
  Timer timer(pair.loop);
  const std::function<void()> again = [&] { timer.after(std::chrono::milliseconds(10), again); };
  again();
  pair.run([&] { return !worker.process.running(); });
}

TEST(AgentTls, AWorkerWithItsCertificateIsKnownByName) {
  test::Farm farm;
  ListenOptions options;
  options.tls = farm.coordinator();
  TlsPair pair(options);
  WorkerProcess worker(pair.listener->port(), arguments_of(farm.files("render7", {Role::kWorker})));
  pair.run([&] { return !pair.at_server.empty(); });
  ASSERT_FALSE(pair.at_server.empty());
  EXPECT_TRUE(std::holds_alternative<Hello>(pair.at_server.front()));
  EXPECT_EQ(pair.server->peer_identity().name, "render7");
  pair.server->send(Goodbye{"done"});
  pair.server->close_after_writes("done");
  run_until_it_ends(pair, worker);
  EXPECT_TRUE(worker.ended_with(0)) << worker.said;
}

TEST(AgentTls, FilesThatDoNotFitAreNamedAtOnce) {
  test::Farm farm, other;
  TlsFiles files = farm.files("render7", {Role::kWorker});
  files.key = other.files("render8", {Role::kWorker}).key;
  WorkerProcess worker(1, arguments_of(files));
  EXPECT_TRUE(worker.ended_with(2)) << worker.process.how_it_ended();
  EXPECT_NE(worker.said.find(files.key.string()), std::string::npos) << worker.said;
}

TEST(AgentTls, ACoordinatorOfAnotherAuthorityIsNotTrusted) {
  test::Farm farm, other;
  ListenOptions options;
  options.tls = other.coordinator();
  TlsPair pair(options);
  std::vector<std::string> arguments = arguments_of(farm.files("render7", {Role::kWorker}));
  arguments.insert(arguments.end(), {"--patience", "1"});
  WorkerProcess worker(pair.listener->port(), arguments);
  run_until_it_ends(pair, worker);
  EXPECT_TRUE(worker.ended_with(1)) << worker.process.how_it_ended();
  EXPECT_NE(worker.said.find("Is it running"), std::string::npos) << worker.said;
  EXPECT_EQ(pair.accepted, 0);
}

}  // namespace
}  // namespace kiln
