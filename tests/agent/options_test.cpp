#include "worker/agent/options.h"

#include <stdlib.h>

#include <fstream>

#include "common/base/json.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {

using namespace test;

// Sets variables for as long as it lives.
class Variables {
 public:
  explicit Variables(std::vector<std::pair<std::string, std::string>> values) : values_(std::move(values)) {
    for (const auto& [name, value] : values_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  Variables(const std::string& name, const std::string& value)
      : Variables(std::vector<std::pair<std::string, std::string>>{{name, value}}) {}
  ~Variables() {
    for (const auto& [name, value] : values_) ::unsetenv(name.c_str());
  }

 private:
  std::vector<std::pair<std::string, std::string>> values_;
};

std::string file_with(const TempDir& dir, const std::string& name, const std::string& content) {
  const std::string path = (dir.path() / name).string();
  std::ofstream(path) << content;
  return path;
}

std::string error_of(const std::vector<std::string>& arguments) {
  const auto options = read_worker_options(arguments);
  return options ? "no error" : options.error().message;
}

TEST(WorkerOptions, TheCommandLineWinsOverTheEnvironment) {
  const Variables set({{"KILN_CONNECT", "farm:1"}, {"KILN_THREADS", "3"}, {"KILN_NAME", "render7"}});
  const auto options = read_worker_options({"--connect", "other:2", "--threads=5"});
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_EQ(options->agent.host, "other");
  EXPECT_EQ(options->agent.port, 2);
  EXPECT_EQ(options->agent.threads, 5u);
  EXPECT_EQ(options->agent.name, "render7");
}

TEST(WorkerOptions, EveryValueCanStandInAFile) {
  const TempDir dir;
  const Variables set({{"KILN_CONNECT_FILE", file_with(dir, "address", "farm:7800\n")},
                       {"KILN_TOKEN_FILE", file_with(dir, "token", "secret \r\n")},
                       {"KILN_THREADS_FILE", file_with(dir, "threads", "6\n")}});
  const auto options = read_worker_options({});
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_EQ(options->agent.host, "farm");
  EXPECT_EQ(options->agent.token, "secret");
  EXPECT_EQ(options->agent.threads, 6u);
  const auto other = read_worker_options({"--token-file", file_with(dir, "other", "second")});
  ASSERT_TRUE(other);
  EXPECT_EQ(other->agent.token, "second");
  const Variables both("KILN_TOKEN", "a");
  EXPECT_NE(error_of({}).find("KILN_TOKEN and KILN_TOKEN_FILE are both set"), std::string::npos)
      << error_of({});
}

TEST(WorkerOptions, LimitsAreReadInTheirUnits) {
  const auto options =
      read_worker_options({"--connect=a:1", "--memory=100", "--cache-size=20", "--unit-limit=7",
                           "--drain-limit=8", "--patience=9", "--alive-file=/run/alive", "--log=json"});
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_EQ(options->agent.memory_bytes, 100u << 20);
  EXPECT_EQ(options->agent.cache_bytes, 20u << 20);
  EXPECT_EQ(options->agent.unit_limit_ms, 7000);
  EXPECT_EQ(options->agent.drain_limit_ms, 8000);
  EXPECT_EQ(options->agent.patience_ms, 9000);
  EXPECT_EQ(options->agent.alive_file, "/run/alive");
  EXPECT_EQ(options->log, LogFormat::kJson);
}

TEST(WorkerOptions, TheCacheIsWhereOthersAreAndOffForLocalWorkers) {
  const Variables set({{"KILN_CONNECT", "a:1"}, {"HOME", "/home/ada"}, {"XDG_CACHE_HOME", ""}});
  EXPECT_EQ(read_worker_options({})->agent.cache_folder, "/home/ada/.cache/kiln-worker");
  {
    const Variables xdg("XDG_CACHE_HOME", "/var/cache/ada");
    EXPECT_EQ(read_worker_options({})->agent.cache_folder, "/var/cache/ada/kiln-worker");
  }
  EXPECT_EQ(read_worker_options({"--cache", "off"})->agent.cache_folder, "");
  const Variables local("KILN_PARENT", "17");
  EXPECT_EQ(read_worker_options({})->agent.cache_folder, "");
  EXPECT_EQ(read_worker_options({"--cache", "/fast"})->agent.cache_folder, "/fast");
}

TEST(WorkerOptions, CertificatesGoTogether) {
  const TempDir dir;
  const std::string ca = file_with(dir, "ca.pem", "x"), certificate = file_with(dir, "c.pem", "x"),
                    key = file_with(dir, "k.pem", "x");
  const auto options =
      read_worker_options({"--connect=a:1", "--ca", ca, "--certificate", certificate, "--key", key});
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_EQ(options->agent.tls.ca, ca);
  EXPECT_EQ(options->agent.tls.certificate, certificate);
  EXPECT_EQ(options->agent.tls.key, key);
  const std::string missing = error_of({"--connect=a:1", "--ca", ca, "--certificate", certificate});
  EXPECT_NE(missing.find("--key is missing"), std::string::npos) << missing;
}

TEST(WorkerOptions, WrongOnesAreNamed) {
  for (const auto& [argument, words] :
       {std::pair("--threads=0", "from 1 to 4096"), std::pair("--threads=-2", "from 1 to 4096"),
        std::pair("--memory=12x", "--memory is \"12x\""), std::pair("--log=xml", "give text or json"),
        std::pair("--token=secret", "--token-file FILE"), std::pair("--token-file=/nowhere", "/nowhere"),
        std::pair("--unit-limit", "needs a value"), std::pair("--frobnicate=1", "unknown option")}) {
    const std::string message = error_of({"--connect=a:1", argument});
    EXPECT_NE(message.find(words), std::string::npos) << argument << ": " << message;
    EXPECT_EQ(message.find("secret"), std::string::npos) << "the token is printed";
  }
  EXPECT_NE(error_of({}).find("no coordinator given"), std::string::npos);
}

TEST(WorkerOptions, HelpNamesEveryOption) {
  const auto help = read_worker_options({"--help"});
  ASSERT_TRUE(help);
  for (const char* name :
       {"--connect", "--token-file", "--ca", "--certificate", "--key", "--patience", "--name", "--threads",
        "--memory", "--cache ", "--cache-size", "--unit-limit", "--drain-limit", "--log", "--alive-file",
        "--replay", "--version", "KILN_TOKEN_FILE"})
    EXPECT_NE(help->print.find(name), std::string::npos) << name;
}

TEST(WorkerProgram, LinesAreJsonWhenAskedAndTheAliveFileIsTouched) {
  const TempDir dir;
  const std::string alive = (dir.path() / "alive").string();
  RawListener listener;
  WorkerProcess worker(listener.port(),
                       {"--log", "json", "--alive-file", alive, "--name", "a \"quoted\" name"});
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  const auto hello = peer->next<Hello>();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->host, "a \"quoted\" name");
  EXPECT_TRUE(std::filesystem::exists(alive));
  peer->send(Refused{"no \"room\"\nat all"});
  EXPECT_TRUE(worker.ended_with(2));
  std::istringstream lines(worker.said);
  std::string line, last;
  while (std::getline(lines, line)) {
    const auto pairs = parse_flat_json(line);
    ASSERT_TRUE(pairs) << line;
    ASSERT_EQ(pairs->size(), 4u);
    EXPECT_EQ((*pairs)[2].second, "kiln-worker");
    last = (*pairs)[1].second;  // keys are sorted
  }
  EXPECT_NE(last.find("no \"room\"\nat all"), std::string::npos) << worker.said;
}

}  // namespace
}  // namespace kiln
