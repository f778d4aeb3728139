// Log lines on standard error, one sentence each; standard output is for results. Whatever a text holds, it
// stays one line and cannot steer a terminal (printable.h).
#pragma once

#include <string_view>

namespace kiln {

enum class LogLevel { kDebug, kInfo, kWarning, kError, kOff };

enum class LogFormat {
  kText,
  kJson,  // an object a line: time (UTC), level, program, message
};

// `name` heads every line ("kiln", "kiln-worker 3"). The default level is kWarning.
void log_setup(std::string_view name, LogLevel level, LogFormat format = LogFormat::kText);
void log_info(std::string_view text);
void log_warning(std::string_view text);
void log_error(std::string_view text);

}  // namespace kiln
