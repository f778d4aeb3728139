#include "common/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

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

void log_setup(std::string_view name, LogLevel level) {
  logger().set_pattern(std::string(name) + ": %l: %v");
  logger().set_level(to_spdlog(level));
}
void log_debug(std::string_view text) {
  logger().debug(text);
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
