// Holds every #include of the product against the rooms that CMake was told a room may use, and looks for
// types that two files define.
#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/architecture/sources.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

// A room's own dependencies and theirs.
std::set<std::string> closure(const Rooms& rooms, const std::string& room) {
  std::set<std::string> seen{room};
  std::vector<std::string> open{room};
  while (!open.empty()) {
    const auto it = rooms.find(open.back());
    open.pop_back();
    if (it == rooms.end()) continue;
    for (const auto& dep : it->second)
      if (seen.insert(dep).second) open.push_back(dep);
  }
  return seen;
}

std::string room_of(const fs::path& relative, const Rooms& rooms) {
  fs::path folder = relative.parent_path();
  while (!folder.empty()) {
    if (rooms.count(folder.generic_string())) return folder.generic_string();
    folder = folder.parent_path();
  }
  return {};
}

template <class Visit>
void for_each_include(const fs::path& file, const Visit& visit) {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::ifstream in(test::source_dir() / file);
  for (std::string line; std::getline(in, line);) {
    std::smatch m;
    if (std::regex_search(line, m, pattern)) visit(m[2].str());
  }
}

TEST(IncludeRules, RoomsIncludeOnlyWhatTheyList) {
  const Rooms rooms = read_rooms();
  ASSERT_GE(rooms.size(), 8u);
  for (const fs::path& file : product_sources()) {
    const std::string room = room_of(file, rooms);
    if (room.empty()) continue;  // a program's main.cpp
    const auto allowed = closure(rooms, room);
    for_each_include(file, [&](const std::string& included) {
      const std::string other = room_of(included, rooms);
      if (!other.empty())
        EXPECT_TRUE(allowed.count(other))
            << file << " includes " << included << ", but " << room << " does not list " << other;
    });
  }
}

TEST(IncludeRules, CoordinatorAndWorkerNeverIncludeEachOther) {
  for (const fs::path& file : product_sources()) {
    const std::string top = file.begin()->string();
    for_each_include(file, [&](const std::string& included) {
      if (top == "coordinator") EXPECT_NE(included.rfind("worker/", 0), 0u) << file;
      if (top == "worker") EXPECT_NE(included.rfind("coordinator/", 0), 0u) << file;
      if (top == "common")
        EXPECT_TRUE(included.rfind("worker/", 0) != 0 && included.rfind("coordinator/", 0) != 0) << file;
    });
  }
}

TEST(IncludeRules, RoomsHaveNoCycle) {
  const Rooms rooms = read_rooms();
  for (const auto& [room, deps] : rooms)
    for (const auto& dep : deps) EXPECT_FALSE(closure(rooms, dep).count(room)) << room << " and " << dep;
}

// The line without what a comment or a string holds.
std::string code_of(const std::string& line) {
  static const std::regex literal(R"("([^"\\]|\\.)*"|'([^'\\]|\\.)')");
  const std::string code = std::regex_replace(line, literal, "");
  return code.substr(0, code.find("//"));
}

// Calls visit(name) for every type that a file defines in a named namespace, outside of types and functions;
// not for a template made for one type (`struct Name<T>`), which several files may do.
template <class Visit>
void for_each_type(const fs::path& file, const Visit& visit) {
  static const std::regex type(R"(^\s*(?:struct|class)\s+([A-Z]\w*)\b(?!\s*(?:::|<))[^;]*\{)");
  static const std::regex brace(R"(namespace\s*([\w:]*)\s*\{|\{|\})");
  std::ifstream in(test::source_dir() / file);
  std::vector<std::string> open;  // by brace: the namespace, or "" for anything else
  for (std::string line; std::getline(in, line);) {
    const std::string code = code_of(line);
    const bool outside = std::find(open.begin(), open.end(), "") == open.end();
    if (std::smatch m; outside && std::regex_search(code, m, type)) {
      std::string name;
      for (const std::string& space : open) name += space + "::";
      visit(name + m[1].str());
    }
    for (std::sregex_iterator it(code.begin(), code.end(), brace), end; it != end; ++it) {
      if ((*it)[0] == "}") {
        if (!open.empty()) open.pop_back();
      } else {
        open.push_back((*it)[1].str());  // an unnamed namespace is "" too: what is in it stays there
      }
    }
  }
}

// Two types of one name in one namespace are undefined behaviour as soon as one program has both, and no
// linker says so.
TEST(IncludeRules, NoTypeIsDefinedTwice) {
  std::map<std::string, fs::path> seen;
  for (const fs::path& file : product_sources()) {
    if (file.extension() == ".cpp" && file.filename() == "main.cpp") continue;
    for_each_type(file, [&](const std::string& name) {
      const auto [at, added] = seen.try_emplace(name, file);
      // Hidden types: declared in a header, defined where they are made.
      if (!added && at->second != file) ADD_FAILURE() << name << " in " << at->second << " and " << file;
    });
  }
  EXPECT_GT(seen.size(), 200u);
}

// A third-party library enters through the files named here, so that replacing it is a one-room change.
TEST(IncludeRules, ThirdPartyHeadersEnterThroughNamedFiles) {
  const std::map<std::string, std::set<std::string>> named = {
      {"glm/", {"common/math/vec.h"}},
      {"fmt/", {"common/base/format.h"}},
      {"spdlog/", {"common/base/log.cpp"}},
      {"openssl/", {"common/base/hash.cpp", "common/tls/openssl_api.h"}},
      {"xxhash.h", {"common/base/hash.cpp"}},
      {"nlohmann/",
       {"common/base/json.cpp", "coordinator/output/chart_table/read_layout.cpp",
        "coordinator/scene/document/expand.cpp", "coordinator/scene/document/expand.h",
        "coordinator/scene/document/gltf_document.cpp", "coordinator/scene/document/gltf_numbers.cpp",
        "coordinator/scene/document/gltf_numbers.h", "coordinator/scene/document/json_weight.cpp",
        "coordinator/scene/document/variants.cpp", "coordinator/scene/document/variants.h",
        "coordinator/output/gltf/buffer.cpp", "coordinator/output/gltf/buffer.h",
        "coordinator/output/gltf/output_file.h", "coordinator/output/probes/published.cpp",
        "coordinator/farm/snapshot/inputs.cpp"}},
      {"sqlite3.h", {"coordinator/farm/queue/sqlite.cpp"}},
      {"httplib.h", {"coordinator/viewer/view_server.cpp", "worker/agent/preemption.cpp"}},
      {"Eigen/", {"common/unwrap/arap.cpp", "common/unwrap/lscm.cpp", "coordinator/bake/seams/solve.cpp"}},
      {"embree", {"worker/accel/embree_api.h"}},
      {"OpenImageIO/", {"coordinator/scene/imageio/oiio.cpp"}},
      {"OpenEXR/", {"coordinator/scene/imageio/exr.cpp"}},
      {"avif/", {"coordinator/scene/imageio/avif.cpp"}},
      {"draco/", {"coordinator/scene/document/draco.cpp"}},
      {"tiny_gltf.h", {"coordinator/scene/import/gltf_model.cpp"}},
      {"asio", {"common/wire/asio_api.h"}},
      {"astcenc.h", {"coordinator/output/astc/astc.cpp"}},
      {"zstd.h", {"common/zstd/compress.cpp"}},
      {"CLI/", {"coordinator/cli/parser.cpp"}},
  };
  for (const fs::path& file : product_sources())
    for_each_include(file, [&](const std::string& included) {
      for (const auto& [prefix, files] : named)
        if (included.rfind(prefix, 0) == 0)
          EXPECT_TRUE(files.count(file.generic_string())) << file << " includes " << included;
    });
}

}  // namespace
}  // namespace kiln
