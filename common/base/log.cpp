#include "common/base/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "common/base/json.h"
#include "common/base/printable.h"

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

// %V: the message, of which much came from peers and files, as one printable line. %J: as a JSON string,
// which is one too.
template <bool kQuoted>
class SafeMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string_view said(message.payload.data(), message.payload.size());
    const std::string words = kQuoted ? json_quote(said) : printable(said);
    out.append(words.data(), words.data() + words.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<SafeMessage<kQuoted>>();
  }
};

std::unique_ptr<spdlog::formatter> text_lines(const std::string& name) {
  auto lines = std::make_unique<spdlog::pattern_formatter>();
  lines->add_flag<SafeMessage<false>>('V').set_pattern(name + ": %l: %V");
  return lines;
}

spdlog::logger& logger() {
  static const auto instance = [] {
    auto made = spdlog::stderr_logger_mt("kiln");
    made->set_level(spdlog::level::warn);
    made->set_formatter(text_lines("%n"));
    return made;
  }();
  return *instance;
}

}  // namespace

void log_setup(std::string_view name, LogLevel level, LogFormat format) {
  if (format == LogFormat::kText) {
    logger().set_formatter(text_lines(std::string(name)));
  } else {
    auto lines = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
    lines->add_flag<SafeMessage<true>>('J').set_pattern(
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
