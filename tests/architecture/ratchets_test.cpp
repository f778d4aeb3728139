// Measures of the code that may get better and never worse: whoever improves one tightens its bound here.
#include <algorithm>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "tests/architecture/sources.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr size_t kMaxFunctionLines = 70, kMaxFileLines = 600, kMaxColumns = 121;
constexpr std::pair<const char*, double> kMinChecks[] = {  // per thousand lines of code
    {"common/", 4},
    {"common/wire/", 13.5},
    {"coordinator/farm/ledger/", 20},
    {"coordinator/farm/dispatch/", 12},
    {"coordinator/farm/queue/", 12}};
constexpr size_t kMaxBoxes = 13, kMaxArrows = 44, kMaxFloors = 9;  // of the drawing in docs/architecture.md

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(test::source_dir() / file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Calls visit(first line, lines) for every function whose braces stand as clang-format puts them.
template <class Visit>
void for_each_function(const std::vector<std::string>& lines, const Visit& visit) {
  static const std::regex other(R"(^\s*(namespace|class|struct|enum|union|extern)\b)");
  std::map<size_t, size_t> begun;  // by indentation
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    const size_t indent = line.find_first_not_of(' ');
    if (indent == std::string::npos || indent > 2) continue;
    if (line.back() == '{' && line.find('(') != std::string::npos && !std::regex_search(line, other))
      begun[indent] = i;
    if (line.substr(indent) == "}" && begun.count(indent)) {
      visit(begun[indent], i - begun[indent] + 1);
      begun.erase(indent);
    }
  }
}

TEST(Ratchets, FunctionsFilesAndLinesAreShort) {
  size_t functions = 0;
  for (const fs::path& file : product_sources()) {
    const std::vector<std::string> lines = lines_of(file);
    EXPECT_LE(lines.size(), kMaxFileLines) << file;
    for (size_t i = 0; i < lines.size(); ++i) EXPECT_LE(lines[i].size(), kMaxColumns) << file << ":" << i + 1;
    for_each_function(lines, [&](size_t first, size_t count) {
      EXPECT_LE(count, kMaxFunctionLines) << file << ":" << first + 1;
      ++functions;
    });
  }
  EXPECT_GT(functions, 2000u);  // else it finds none
}

// Other versions format otherwise.
constexpr const char* kFormatter = "clang-format version 14.";

TEST(Ratchets, SourcesAreFormatted) {
  if (test::run_command("clang-format --version").output.find(kFormatter) == std::string::npos)
    GTEST_SKIP() << "there is no " << kFormatter;
  const test::CommandResult result =
      test::run_command("cd '" + test::source_dir().string() +
                        "' && find common coordinator worker tests \\( -name '*.h' -o -name '*.cpp' \\) -not "
                        "-path '*/node_modules/*' "
                        "-print0 | xargs -0 -n 60 clang-format --dry-run -Werror");
  EXPECT_EQ(result.exit_status, 0) << result.output;
}

TEST(Ratchets, InvariantsAreChecked) {
  const auto checks = [](const std::string& folder) {
    double count = 0, code = 0;
    for (const fs::path& file : product_sources()) {
      if (file.generic_string().rfind(folder, 0) != 0) continue;
      for (const std::string& line : lines_of(file)) {
        const size_t text = line.find_first_not_of(' ');
        if (text == std::string::npos || line.compare(text, 2, "//") == 0) continue;
        ++code;
        count += line.find("KILN_CHECK(") != std::string::npos;
      }
    }
    return 1000 * count / code;
  };
  for (const auto& [folder, least] : kMinChecks) EXPECT_GE(checks(folder), least) << folder;
}

// A wing, or a room above the wings; all of common, and all of worker.
std::string box_of(const std::string& room) {
  const size_t first = room.find('/');
  if (room.substr(0, first) != "coordinator") return room.substr(0, first);
  return room.substr(0, room.find('/', first + 1));
}

TEST(Ratchets, TheHouseCanBeDrawn) {
  std::map<std::string, std::set<std::string>> below;
  for (const auto& [room, deps] : read_rooms())
    for (const std::string& dep : deps) {
      below[box_of(dep)];
      if (box_of(dep) != box_of(room)) below[box_of(room)].insert(box_of(dep));
    }
  size_t arrows = 0, floors = 0;
  std::map<std::string, size_t> floor;
  // Boxes stand one floor above the highest that they use; in a circle nobody ever finds a floor.
  for (bool changed = true; changed && floor.size() <= below.size();) {
    changed = false;
    for (const auto& [box, deps] : below) {
      size_t height = 1;
      for (const std::string& dep : deps) height = floor.count(dep) ? std::max(height, floor[dep] + 1) : 0;
      if (std::any_of(deps.begin(), deps.end(), [&](const auto& d) { return !floor.count(d); })) continue;
      if (floor.emplace(box, height).second) changed = true;
    }
  }
  for (const auto& [box, deps] : below) {
    arrows += deps.size();
    EXPECT_TRUE(floor.count(box)) << box << " is part of a circle";
    floors = std::max(floors, floor[box]);
  }
  EXPECT_LE(below.size(), kMaxBoxes);
  EXPECT_LE(arrows, kMaxArrows);
  EXPECT_LE(floors, kMaxFloors);
}

// Functions that a header declares are called somewhere, in the product or in a test. A word counts once in
// its header and once where it is defined.
TEST(Ratchets, FunctionsOfHeadersAreUsed) {
  static const std::regex comment(R"(//.*)"), word(R"([A-Za-z_]\w*)"), function(R"(\b([a-z]\w{2,})\s*\()");
  // Of the language, the standard library and Embree: named, not declared.
  static const std::regex foreign(
      R"(^(rtc|clock_gettime|calloc|copysign|target_clones|optimize|allocate|deallocate|construct).*)");
  std::map<std::string, std::map<std::string, size_t>> found;  // by word and file
  std::map<std::string, std::set<std::string>> declared;       // by header without .h
  for (const char* top : {"common", "coordinator", "worker", "tests"})
    for (const fs::path& file : sources_below(top)) {
      const std::string name = file.generic_string();
      for (std::string line : lines_of(file)) {
        line = std::regex_replace(line, comment, "");
        if (file.extension() == ".cpp" && !line.starts_with(' ')) continue;
        for (std::sregex_iterator it(line.begin(), line.end(), word), end; it != end; ++it)
          ++found[it->str()][name];
        if (file.extension() != ".h" || std::string(top) == "tests") continue;
        for (std::sregex_iterator it(line.begin(), line.end(), function), end; it != end; ++it)
          declared[name.substr(0, name.size() - 2)].insert((*it)[1]);
      }
    }
  size_t functions = 0;
  for (const auto& [stem, names] : declared)
    for (const std::string& name : names) {
      if (std::regex_match(name, foreign)) continue;
      ++functions;
      bool used = false;
      for (const auto& [file, count] : found[name]) used |= file != stem + ".h" || count > 1;
      EXPECT_TRUE(used) << stem << ".h declares " << name << ", which nobody calls";
    }
  EXPECT_GT(functions, 2000u);
}

// Files and folders that docs and comments name are there.
TEST(Ratchets, NamedFilesExist) {
  static const std::regex file(
      R"((^|[^\w/.-])((common|worker|coordinator|tests|docs|configs|docker)/[\w/.-]*?\.(h|cpp|py|md|sh|json|glsl))\b)");
  static const std::regex folder(R"(`((common|worker|coordinator|tests|docs|configs|docker)/[\w/-]+)`)");
  const std::set<std::string> generated = {"common/wire/messages_generated.h"};
  size_t named = 0;
  for (const char* top : {"common", "coordinator", "worker", "tests", "docs"})
    for (const auto& entry : fs::recursive_directory_iterator(test::source_dir() / top)) {
      const std::string extension = entry.path().extension();
      if (entry.path().string().find("node_modules") != std::string::npos ||
          (extension != ".h" && extension != ".cpp" && extension != ".md" && extension != ".py"))
        continue;
      for (const std::string& line : lines_of(fs::relative(entry.path(), test::source_dir()))) {
        for (std::sregex_iterator it(line.begin(), line.end(), file), end; it != end; ++it, ++named)
          EXPECT_TRUE(generated.count((*it)[2]) || fs::exists(test::source_dir() / (*it)[2].str()))
              << entry.path() << " names " << (*it)[2];
        for (std::sregex_iterator it(line.begin(), line.end(), folder), end; it != end; ++it, ++named) {
          const fs::path path = test::source_dir() / (*it)[1].str();
          EXPECT_TRUE(fs::exists(path) || fs::exists(path.string() + ".h") ||
                      fs::exists(path.string() + ".cpp"))
              << entry.path() << " names " << (*it)[1];
        }
      }
    }
  EXPECT_GT(named, 1000u);
}

}  // namespace
}  // namespace kiln
