// kiln completion, and the manual pages of a package.
#include <cstdio>
#include <filesystem>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/cli/pages.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

Status write_pages(const fs::path& folder, const std::vector<Command>& commands) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return fail(ErrorKind::kUsage, text("cannot make {}: {}", folder.string(), code.message()));
  KILN_TRY_STATUS(write_file_atomic(folder / "kiln.1", manual_page(commands)));
  for (const Command& command : commands)
    if (!command.hidden)
      KILN_TRY_STATUS(write_file_atomic(folder / text("kiln-{}.1", command.name), manual_page(command)));
  return {};
}

}  // namespace

Command completion_command(const std::vector<Command>& commands) {
  Command c;
  c.name = "completion";
  c.about = "Print a script that lets a shell complete commands and options";
  c.example =
      "kiln completion bash > ~/.local/share/bash-completion/completions/kiln\n"
      "  kiln completion zsh > ~/.zfunc/_kiln\n"
      "  kiln completion fish > ~/.config/fish/completions/kiln.fish";
  c.options = {{"shell", "SHELL", "bash, zsh or fish", true}};
  c.run = [commands](const Arguments& arguments, const BakeSettings&) {
    const std::string shell = arguments.get("shell"), script = completion_script(shell, commands);
    if (script.empty())
      return report_error(
          {ErrorKind::kUsage, text("'{}': there is completion for bash, zsh and fish", shell)});
    std::fputs(script.c_str(), stdout);
    return 0;
  };
  return c;
}

Command manual_pages_command(const std::vector<Command>& commands) {
  Command c;
  c.name = "manual-pages";
  c.about = "Write manual pages of all commands, for packages";
  c.example = "kiln manual-pages -o build/man";
  c.options = {{"-o,--output", "DIR", "folder, created if needed", true}};
  c.hidden = true;
  c.run = [commands](const Arguments& arguments, const BakeSettings&) {
    const Status written = write_pages(arguments.get("output"), commands);
    return written ? 0 : report_error(written.error());
  };
  return c;
}

}  // namespace kiln
