#include "worker/agent/preemption.h"

#include <httplib.h>

#include <filesystem>
#include <optional>

#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/log.h"

namespace kiln {
namespace {

constexpr time_t kAnswerSeconds = 1;
constexpr size_t kMaxAnswer = 64u << 10;  // bytes; a longer answer is none

// The body of a 200, or nothing.
std::optional<std::string> answer_of(httplib::Client& client, const std::string& path,
                                     const httplib::Headers& headers) {
  std::string body;
  const auto response = client.Get(path, headers, [&](const char* data, size_t size) {
    if (body.size() + size > kMaxAnswer) return false;
    body.append(data, size);
    return true;
  });
  if (!response || response->status != 200) return std::nullopt;
  return body;
}

std::string aws_notice(httplib::Client& client) {
  const auto token =
      client.Put("/latest/api/token", {{"X-aws-ec2-metadata-token-ttl-seconds", "60"}}, "", "text/plain");
  if (!token || token->status != 200 || token->body.size() > kMaxAnswer) return "";
  // 404 until there is a notice.
  const auto action = answer_of(client, "/latest/meta-data/spot/instance-action",
                                {{"X-aws-ec2-metadata-token", token->body}});
  return action ? "AWS will take this machine" : "";
}

std::string gcp_notice(httplib::Client& client) {
  const auto preempted =
      answer_of(client, "/computeMetadata/v1/instance/preempted", {{"Metadata-Flavor", "Google"}});
  return preempted && preempted->starts_with("TRUE") ? "Google Cloud will take this machine" : "";
}

std::string azure_notice(httplib::Client& client) {
  const auto answer =
      answer_of(client, "/metadata/scheduledevents?api-version=2020-07-01", {{"Metadata", "true"}});
  const auto document = answer ? parse_json(*answer) : fail(ErrorKind::kUnavailable, "no answer");
  const JsonValue* events = document ? document->find("Events") : nullptr;
  if (!events) return "";
  for (const JsonValue& event : events->items)
    if (const JsonValue* type = event.find("EventType"))
      if (type->text == "Preempt" || type->text == "Terminate") return "Azure will take this machine";
  return "";
}

}  // namespace

std::string preemption_notice(const PreemptionSettings& settings) {
  std::error_code code;
  if (!settings.file.empty() && std::filesystem::exists(settings.file, code))
    return text("{} exists", settings.file);
  if (settings.cloud == Cloud::kNone) return "";
  httplib::Client client(settings.address, settings.port);
  client.set_connection_timeout(kAnswerSeconds);
  client.set_read_timeout(kAnswerSeconds);
  client.set_write_timeout(kAnswerSeconds);
  return settings.cloud == Cloud::kAws   ? aws_notice(client)
         : settings.cloud == Cloud::kGcp ? gcp_notice(client)
                                         : azure_notice(client);
}

PreemptionWatch::PreemptionWatch(const PreemptionSettings& settings,
                                 std::function<void(const std::string&)> on_notice)
    : settings_(settings), on_notice_(std::move(on_notice)), thread_([this] { watch(); }) {}

PreemptionWatch::~PreemptionWatch() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void PreemptionWatch::watch() {
  for (;;) {
    if (const std::string notice = preemption_notice(settings_); !notice.empty()) return on_notice_(notice);
    std::unique_lock lock(mutex_);
    if (ended_.wait_for(lock, settings_.every, [this] { return end_; })) return;
  }
}

}  // namespace kiln
