#include "tests/service/service_host.h"

#include <thread>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/service/job_settings.h"

namespace kiln::test {

ServiceHost::ServiceHost(const std::filesystem::path& folder, uint32_t workers, uint32_t active_jobs) {
  settings.data = folder;
  settings.active_jobs = active_jobs;
  settings.farm.local_workers = workers;
  settings.farm.worker_program = binary_dir() / "bin/kiln-worker";
  restart();
}

Expected<std::unique_ptr<Service>> ServiceHost::start() {
  return Service::start(settings);
}

void ServiceHost::restart() {
  service.reset();
  auto started = start();
  ASSERT_TRUE(started) << started.error().message;
  service = std::move(*started);
}

std::string ServiceHost::server() const {
  return text("127.0.0.1:{}", service->port());
}

std::unique_ptr<ServiceClient> ServiceHost::client(const std::string& token_file, const std::string& user) {
  ClientOptions options;
  options.server = server();
  options.user = user;
  const auto bytes = read_file(settings.data / token_file);
  if (bytes) options.token.assign(reinterpret_cast<const char*>(bytes->data()), bytes->size() - 1);
  auto made = ServiceClient::connect(options);
  EXPECT_TRUE(made) << made.error().message;
  return made ? std::move(*made) : nullptr;
}

BakeSettings quick_settings() {
  BakeSettings s;
  for (const auto& [name, value] : {std::pair{"layout", "pack"},
                                    {"texels-per-metre", "2"},
                                    {"min-samples", "16"},
                                    {"max-samples", "64"},
                                    {"tile-texels", "16"}})
    EXPECT_TRUE(set_option(s, name, value, "test"));
  return s;
}

std::string submission(const Snapshot& snapshot, const std::string& key, const std::string& more) {
  std::string files;
  for (const FileRecord& f : snapshot.files)
    files += text("{}{{\"path\":{},\"digest\":\"{}\",\"size\":{}}}", files.empty() ? "" : ",",
                  json_quote(f.path), f.digest.hex(), f.size);
  return text("{{\"key\":{},\"scene\":{},\"settings\":{},\"inputs\":[{}]{}}}", json_quote(key),
              json_quote(snapshot.scene), json_quote(write_job_settings(snapshot.settings)), files, more);
}

uint64_t submit(ServiceClient& client, const Snapshot& snapshot, const std::string& key,
                const std::string& more) {
  const std::string question = submission(snapshot, key, more);
  JsonValue answer = ask(client, "submit", question);
  if (const JsonValue* missing = answer.find("missing"))
    for (const JsonValue& digest : missing->items)
      for (size_t i = 0; i < snapshot.files.size(); ++i)
        if (snapshot.files[i].digest.hex() == digest.text)
          EXPECT_TRUE(
              client.upload(snapshot.sources[i], snapshot.files[i].digest, snapshot.files[i].size, {}));
  if (!answer.find("id")) answer = ask(client, "submit", question);
  return answer.find("id") ? answer.find("id")->whole : 0;
}

JsonValue ask(ServiceClient& client, const std::string& verb, const std::string& document) {
  const auto reply = client.call(verb, document);
  EXPECT_TRUE(reply) << verb << ": " << reply.error().message;
  const auto value = parse_json(reply ? *reply : "{}");
  EXPECT_TRUE(value);
  return value ? *value : JsonValue{};
}

std::string ask_error(ServiceClient& client, const std::string& verb, const std::string& document) {
  const auto reply = client.call(verb, document);
  EXPECT_FALSE(reply) << verb << " " << document.substr(0, 200);
  return reply ? "" : reply.error().message;
}

std::string state_of(ServiceClient& client, uint64_t id) {
  const JsonValue job = ask(client, "job", text("{{\"id\":{}}}", id));
  return job.find("state") ? job.find("state")->text : "";
}

std::string wait_for_state(ServiceClient& client, uint64_t id, const std::string& states) {
  std::string state;
  for (int i = 0; i < 1200; ++i) {
    state = state_of(client, id);
    if (states.find(state) != std::string::npos) return state;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return state;
}

std::map<std::string, std::string> fetched(ServiceClient& client, uint64_t id,
                                           const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::map<std::string, std::string> digests;
  const JsonValue answer = ask(client, "fetch", text("{{\"id\":{}}}", id));
  const JsonValue* files = answer.find("files");
  if (!files) return digests;
  for (const JsonValue& f : files->items) {
    const std::string path = f.find("path")->text;
    const auto digest = Digest::from_hex(f.find("digest")->text);
    const Status s = client.download({id, path, *digest, f.find("size")->whole}, folder / path, {});
    EXPECT_TRUE(s) << s.error().message;
    const auto bytes = read_file(folder / path);
    if (bytes) digests[path] = sha256(*bytes).hex();
  }
  return digests;
}

}  // namespace kiln::test
