#include "tests/support/paths.h"

#include <stdlib.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>

#include "common/base/check.h"

namespace kiln::test {
namespace fs = std::filesystem;

fs::path source_dir() {
  return KILN_SOURCE_DIR;
}
fs::path binary_dir() {
  return KILN_BINARY_DIR;
}

std::optional<fs::path> shared_scene(const std::string& file) {
  const char* from_environment = ::getenv("KILN_SCENES");
  const fs::path folder = from_environment ? fs::path(from_environment) : source_dir() / "../shared/scenes";
  std::error_code code;
  if (fs::exists(folder / file, code)) return folder / file;
  return std::nullopt;
}

TempDir::TempDir() {
  std::string pattern = (fs::temp_directory_path() / "kiln-test-XXXXXX").string();
  KILN_CHECK(::mkdtemp(pattern.data()) != nullptr);
  path_ = pattern;
}
TempDir::~TempDir() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

CommandResult run_command(const std::string& command) {
  CommandResult result{-1, {}};
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  KILN_CHECK(pipe != nullptr);
  std::array<char, 4096> buffer;
  while (size_t got = ::fread(buffer.data(), 1, buffer.size(), pipe))
    result.output.append(buffer.data(), got);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) result.exit_status = WEXITSTATUS(status);
  return result;
}

CommandResult run_kiln(const fs::path& folder, const std::string& arguments) {
  return run_command("cd '" + folder.string() + "' && '" + (binary_dir() / "bin/kiln").string() + "' " +
                     arguments);
}

}  // namespace kiln::test
