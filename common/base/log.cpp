#include "common/base/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "common/base/json.h"

namespace kiln {
namespace {

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
    case LogLevel::kOff:
      return spdlog::level::off;
  }
  return spdlog::level::info;
}

// %J: the message as a JSON string.
class JsonMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string quoted = json_quote({message.payload.data(), message.payload.size()});
    out.append(quoted.data(), quoted.data() + quoted.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonMessage>(); }
};

spdlog::logger& logger() {
  static const auto instance = [] {
    auto made = spdlog::stderr_logger_mt("kiln");
    made->set_level(spdlog::level::warn);
    made->set_pattern("%n: %l: %v");
    return made;
  }();
  return *instance;
}

}  // namespace

void log_setup(std::string_view name, LogLevel level, LogFormat format) {
  if (format == LogFormat::kText) {
    logger().set_pattern(std::string(name) + ": %l: %v");
  } else {
    auto lines = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
    lines->add_flag<JsonMessage>('J').set_pattern(
        R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","program":)" + json_quote(name) +
        R"(,"message":%J})");
    logger().set_formatter(std::move(lines));
  }
  logger().set_level(to_spdlog(level));
}
void log_info(std::string_view text) {
  logger().info(text);
}
void log_warning(std::string_view text) {
  logger().warn(text);
}
void log_error(std::string_view text) {
  logger().error(text);
}

}  // namespace kiln
