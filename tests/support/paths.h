// A guard by macro, not #pragma once: this header is in the precompiled one, whose copy from a compiler cache
// may name another checkout's file.
#ifndef KILN_TESTS_SUPPORT_PATHS_H_
#define KILN_TESTS_SUPPORT_PATHS_H_

#include <filesystem>
#include <optional>
#include <string>

namespace kiln::test {

std::filesystem::path source_dir();  // root of the checkout
std::filesystem::path binary_dir();  // build tree; programs are in its bin/
// Scenes made by others that live beside the checkout; absent on most machines: skip, saying so.
std::optional<std::filesystem::path> shared_scene(const std::string& file);

// A fresh folder, removed with everything in it at the end.
class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct CommandResult {
  int exit_status;     // -1: killed by a signal
  std::string output;  // standard output and error together
};
// Runs a shell command and waits for it.
CommandResult run_command(const std::string& command);
// bin/kiln with these arguments, in that folder.
CommandResult run_kiln(const std::filesystem::path& folder, const std::string& arguments);

}  // namespace kiln::test

#endif  // KILN_TESTS_SUPPORT_PATHS_H_
