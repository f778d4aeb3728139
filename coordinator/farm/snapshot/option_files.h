// Options that name a file which affects the bake. The unwrap cache names a folder and does not.
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
// ROOM: add a line here for an option that names a file.
inline constexpr std::array<FileOption, 3> kFileOptions{{{"environment", &BakeSettings::environment},
                                                         {"keep-layout", &BakeSettings::keep_layout},
                                                         {"probes", &BakeSettings::probes}}};

inline bool names_file(const FileOption& option, const std::string& value) {
  if (option.value == &BakeSettings::probes) return value != "auto" && value != "scene" && value != "off";
  return !value.empty() && !(option.value == &BakeSettings::environment && parse_radiance(value));
}

// Path in the snapshot. Keeps the file name, which determines the format and appears in messages.
inline std::string path_of_option(const FileOption& option, const std::string& value) {
  return std::string(kOptions) + "/" + option.name + "/" + std::filesystem::path(value).filename().string();
}

}  // namespace kiln
