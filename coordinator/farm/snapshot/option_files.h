// Options that name a file which decides what is baked. The cache of unwrapping names a folder, and decides
// nothing.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "common/job/settings.h"
#include "coordinator/farm/snapshot/snapshot.h"

namespace kiln {

struct FileOption {
  const char* name;  // as in settings_table()
  std::string BakeSettings::*value;
};
// ROOM: an option that names a file has its line here.
inline constexpr std::array<FileOption, 2> kFileOptions{
    {{"environment", &BakeSettings::environment}, {"keep-layout", &BakeSettings::keep_layout}}};

inline bool names_file(const FileOption& option, const std::string& value) {
  return !value.empty() && !(option.value == &BakeSettings::environment && parse_radiance(value));
}

// In the snapshot. The name stays: formats and messages are known by it.
inline std::string path_of_option(const FileOption& option, const std::string& value) {
  return std::string(kOptions) + "/" + option.name + "/" + std::filesystem::path(value).filename().string();
}

}  // namespace kiln
