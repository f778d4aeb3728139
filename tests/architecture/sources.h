// The product's files and rooms, as the tests of its structure see them.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace kiln {

// By room: the rooms that its CMakeLists.txt lists.
using Rooms = std::map<std::string, std::set<std::string>>;

inline Rooms read_rooms() {
  Rooms rooms;
  std::ifstream in(test::binary_dir() / "rooms.txt");
  for (std::string line; std::getline(in, line);) {
    const size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    std::istringstream deps(line.substr(colon + 1));
    auto& set = rooms[line.substr(0, colon)];
    for (std::string dep; deps >> dep;) set.insert(dep);
  }
  return rooms;
}

// Headers and sources below a folder, relative to the checkout.
inline std::vector<std::filesystem::path> sources_below(const char* top) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(test::source_dir() / top))
    if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
      files.push_back(std::filesystem::relative(entry.path(), test::source_dir()));
  return files;
}

// Of the product.
inline std::vector<std::filesystem::path> product_sources() {
  std::vector<std::filesystem::path> files;
  for (const char* top : {"common", "coordinator", "worker"})
    for (std::filesystem::path& file : sources_below(top)) files.push_back(std::move(file));
  return files;
}

}  // namespace kiln
