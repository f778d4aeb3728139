// What is refused, and in which words.
#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/service/verbs.h"
#include "tests/bake/scene_gltf.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

class Requests : public testing::Test {
 protected:
  Requests() : host_(dir_.path() / "data", 0) {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  TempDir dir_;
  ServiceHost host_;
  Snapshot snapshot_;
};

TEST_F(Requests, TokensAndRoles) {
  const auto refusal = [&](const std::string& token) {
    ClientOptions options;
    options.server = host_.server();
    options.user = "eve";
    options.token = token;
    const auto client = ServiceClient::connect(options);
    EXPECT_FALSE(client);
    return client ? "" : client.error().message;
  };
  EXPECT_NE(refusal("").find("no token was given"), std::string::npos);
  EXPECT_NE(refusal("0123456789abcdef0123456789abcdef").find("not one of this coordinator's"),
            std::string::npos);
  const auto tokens = service_tokens(host_.settings.data);
  ASSERT_TRUE(tokens);
  EXPECT_NE(refusal(tokens->worker.shared).find("token of workers"), std::string::npos);
  for (const char* name : {"admin.token", "submit.token", "read.token", "worker.token", "web.token"}) {
    struct stat about {};
    ASSERT_EQ(::stat((host_.settings.data / name).c_str(), &about), 0) << name;
    EXPECT_EQ(about.st_mode & 0777, 0600u) << name;
  }

  const auto reader = host_.client("read.token"), ada = host_.client("submit.token", "ada"),
             eve = host_.client("submit.token", "eve"), admin = host_.client("admin.token", "root");
  EXPECT_NE(ask_error(*reader, "submit", submission(snapshot_, "k")).find("needs the role submit"),
            std::string::npos);
  const uint64_t id = submit(*ada, snapshot_, "k");
  ASSERT_NE(id, 0u);
  const std::string document = text("{{\"id\":{}}}", id);
  EXPECT_NE(ask_error(*eve, "cancel", document).find("may change only their own jobs"), std::string::npos);
  EXPECT_NE(
      ask_error(*eve, "priority", text("{{\"id\":{},\"priority\":100}}", id)).find("only their own jobs"),
      std::string::npos);
  EXPECT_NE(ask_error(*ada, "forgive", R"({"worker":"x"})").find("needs the role admin"), std::string::npos);
  EXPECT_EQ(ask(*reader, "job", document).find("user")->text, "ada");
  ask(*admin, "cancel", document);
  EXPECT_EQ(wait_for_state(*reader, id, "cancelled"), "cancelled");
}

unsigned mode_of(const fs::path& path) {
  struct stat about {};
  EXPECT_EQ(::stat(path.c_str(), &about), 0) << path;
  return about.st_mode & 0777;
}

TEST_F(Requests, TheDataFolderIsItsOwnersAlone) {
  const auto ada = host_.client("submit.token", "ada");
  ASSERT_NE(submit(*ada, snapshot_, "k"), 0u);
  const fs::path data = host_.settings.data;
  EXPECT_EQ(mode_of(data), 0700u);
  size_t blobs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data / "blobs")) {
    EXPECT_EQ(mode_of(entry.path()), entry.is_directory() ? 0700u : 0600u) << entry.path();
    blobs += entry.is_regular_file();
  }
  EXPECT_GT(blobs, 0u);
  host_.service.reset();
  ASSERT_EQ(::chmod(data.c_str(), 0755), 0);
  host_.restart();
  EXPECT_EQ(mode_of(data), 0700u) << "one that an older release left open is closed";
}

// As a process, whose mask also holds for files that libraries make.
TEST_F(Requests, EverythingThatServeMakesIsItsOwnersAlone) {
  const fs::path data = dir_.path() / "served";
  const auto result =
      run_command("umask 022; '" + (binary_dir() / "bin/kiln").string() + "' serve --data '" + data.string() +
                  "' --listen 127.0.0.1:0 & p=$!; for i in $(seq 300); do [ -e '" + data.string() +
                  "/worker.token' ] && break; sleep 0.1; done; kill $p; wait $p");
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    EXPECT_EQ(mode_of(entry.path()), entry.is_directory() ? 0700u : 0600u) << entry.path();
    files += entry.is_regular_file();
  }
  EXPECT_EQ(mode_of(data), 0700u);
  EXPECT_GE(files, 5u) << result.output;
}

TEST_F(Requests, ThePagesTokenOpensNothingElse) {
  const fs::path data = dir_.path() / "pages", file = dir_.path() / "token";
  ASSERT_TRUE(write_private_file(file, "one-token-for-everything\n"));
  const auto serve = [&](const std::string& more) {
    return run_command("timeout 60 '" + (binary_dir() / "bin/kiln").string() + "' serve --data '" +
                       data.string() + "' --listen 127.0.0.1:0 --http 127.0.0.1:0 " + more);
  };
  const auto same = serve("--token-file '" + file.string() + "' --http-token-file '" + file.string() + "'");
  EXPECT_EQ(same.exit_status, 2);
  EXPECT_NE(same.output.find("is the workers' token too"), std::string::npos) << same.output;
  for (const char* name : {"submit.token", "admin.token", "worker.token"})
    EXPECT_EQ(serve("--http-token-file '" + (data / name).string() + "'").exit_status, 2) << name;
}

std::vector<JsonValue> audit_of(const fs::path& file) {
  const auto bytes = read_file(file);
  std::vector<JsonValue> lines;
  std::istringstream words(bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size())
                                 : "");
  for (std::string line; std::getline(words, line);) {
    const auto value = parse_json(line);
    EXPECT_TRUE(value) << line;
    if (value) lines.push_back(*value);
  }
  return lines;
}

std::string member(const JsonValue& line, const char* name) {
  const JsonValue* value = line.find(name);
  return !value            ? ""
         : value->is_whole ? (value->negative ? "-" : "") + std::to_string(value->whole)
                           : value->text;
}

TEST_F(Requests, WhoChangedWhatIsALineEach) {
  const auto ada = host_.client("submit.token", "ada"), root = host_.client("admin.token", "ro\\ot"),
             reader = host_.client("read.token", "eve");
  const uint64_t id = submit(*ada, snapshot_, "k", ",\"name\":\"a \\\"room\\\"\"");
  const std::string document = text("{{\"id\":{}}}", id);
  ask(*reader, "jobs", "{}");
  ask_error(*reader, "cancel", document);
  ask(*ada, "priority", text("{{\"id\":{},\"priority\":-7}}", id));
  ask(*ada, "pause", document);
  ask(*root, "cancel", document);
  ask_error(*root, "forgive", R"({"worker":"render7"})");  // which nobody knows
  const fs::path file = host_.settings.data / "audit.jsonl";
  EXPECT_EQ(mode_of(file), 0600u);
  const auto lines = audit_of(file);
  std::vector<std::string> said;
  for (const JsonValue& line : lines)
    said.push_back(member(line, "user") + " " + member(line, "access") + " " + member(line, "verb") + " " +
                   member(line, "job") + " " + member(line, "priority") + member(line, "name") +
                   member(line, "worker"));
  const std::string job = std::to_string(id);
  EXPECT_EQ(said, (std::vector<std::string>{
                      "ada submit submit " + job + " a \"room\"", "ada submit priority " + job + " -7",
                      "ada submit pause " + job + " ", "ro\\ot admin cancel " + job + " "}));
  for (const JsonValue& line : lines) {
    EXPECT_EQ(member(line, "time").size(), std::string("2027-03-01T12:00:00.123Z").size());
    EXPECT_EQ(member(line, "peer").rfind("127.0.0.1:", 0), 0u);
  }
  // A rotation renames the file; a crash may leave half a line.
  fs::rename(file, dir_.path() / "audit.1");
  EXPECT_EQ(wait_for_state(*root, id, "cancelled"), "cancelled");
  ask(*root, "retry", document);
  EXPECT_EQ(audit_of(dir_.path() / "audit.1").size(), 4u);
  ASSERT_EQ(audit_of(file).size(), 1u);
  host_.service.reset();
  std::ofstream(file, std::ios::app) << "{\"time\":";
  host_.restart();
  ask(*host_.client("admin.token", "root"), "cancel", document);
  std::ifstream whole(file);
  std::string first, half, last;
  std::getline(whole, first), std::getline(whole, half), std::getline(whole, last);
  EXPECT_EQ(half, "{\"time\":");
  EXPECT_EQ(member(parse_json(last).value_or(JsonValue()), "verb"), "cancel") << last;
}

TEST_F(Requests, EachVerbRefusesDocumentsThatAreNotItsOwn) {
  const auto client = host_.client();
  for (const Verb& verb : verb_table())
    for (const char* document : {"", "{", "[]", "7", "null", R"({"surprise":1})", R"({"id":"x","id":1})"}) {
      const std::string error = ask_error(*client, verb.name, document);
      EXPECT_EQ(error.find(verb.name), 0u) << verb.name << " " << document << ": " << error;
    }
  EXPECT_NE(ask_error(*client, "dance", "{}").find("has no verb 'dance'"), std::string::npos);
  const std::pair<const char*, const char*> cases[] = {{"{}", "'id' is missing"},
                                                       {R"({"id":0})", "'id' must be"},
                                                       {R"({"id":-1})", "'id' must be"},
                                                       {R"({"id":1.5})", "'id' must be"},
                                                       {R"({"id":"1"})", "'id' must be"},
                                                       {R"({"id":1e300})", "'id' must be"},
                                                       {R"({"id":18446744073709551615})", "'id' must be"},
                                                       {R"({"id":9})", "there is no job 9"}};
  for (const auto& [document, words] : cases)
    EXPECT_NE(ask_error(*client, "cancel", document).find(words), std::string::npos) << document;
  EXPECT_NE(ask_error(*client, "jobs", std::string(100, '[')).find("nested too deeply"), std::string::npos);
}

TEST_F(Requests, ASubmissionIsHeldAgainstEveryRule) {
  const auto client = host_.client();
  const auto refused = [&](const std::string& more, const std::string& words) {
    const std::string error = ask_error(*client, "submit", submission(snapshot_, "k", more));
    EXPECT_NE(error.find(words), std::string::npos) << more << ": " << error;
  };
  refused(",\"priority\":101", "'priority'");
  refused(",\"quorum\":0", "'quorum'");
  refused(",\"on_poison\":\"eat\"", "'on_poison'");
  refused(",\"after\":[0]", "'after'");
  refused(",\"after\":7", "'after'");
  refused(",\"name\":\"a\\u0007b\"", "control character");
  const auto with_settings = [&](const std::string& settings) {
    Snapshot s = snapshot_;
    std::string question = submission(s, "k");
    const size_t at = question.find("\"settings\":") + 11, end = question.find(",\"inputs\"");
    return question.replace(at, end - at, json_quote(settings));
  };
  const std::pair<const char*, const char*> settings[] = {
      {R"({"environment":"/etc/passwd"})", "not among the job's files"},
      {R"({"keep-layout":"../../x.json"})", "not among the job's files"},
      {R"({"unwrap-cache":"/root"})", "coordinator's own"},
      {R"({"workers":"9"})", "coordinator's own"},
      {R"({"max-samples":"-1"})", "max-samples"},
      {R"({"min-samples":7})", "min-samples"},
      {R"({"dance":"1"})", "no setting 'dance'"},
      {"[", "'settings'"}};
  for (const auto& [document, words] : settings) {
    const std::string error = ask_error(*client, "submit", with_settings(document));
    EXPECT_NE(error.find(words), std::string::npos) << document << ": " << error;
  }
  Snapshot outside = snapshot_;
  outside.files[0].path = outside.scene = "../room.glb";
  EXPECT_NE(ask_error(*client, "submit", submission(outside, "k")).find("relative path"), std::string::npos);
  EXPECT_TRUE(host_.service->jobs().empty());
}

TEST_F(Requests, AnUploadThatIsNotWhatItSaidIsNotTaken) {
  const auto client = host_.client();
  const Digest other = sha256(bytes_of("another file"));
  const Status s = client->upload(dir_.path() / "room.glb", other, snapshot_.files[0].size, {});
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().message.find("changed on its way"), std::string::npos) << s.error().message;
  const auto answer = ask(*client, "submit", submission(snapshot_, "k"));
  EXPECT_EQ(answer.find("missing")->items.size(), snapshot_.files.size());
  EXPECT_EQ(answer.find("id"), nullptr);
}

TEST_F(Requests, OneServiceForAFolder) {
  const auto second = host_.start();
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find(host_.settings.data.string()), std::string::npos)
      << second.error().message;
}

}  // namespace
}  // namespace kiln::test
