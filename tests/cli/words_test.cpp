// Words that a user types: mistakes are answered with what may have been meant, and what is written for
// shells and manuals knows every command and option.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "coordinator/cli/pages.h"
#include "coordinator/cli/suggest.h"
#include "tests/support/paths.h"

namespace kiln::test {
namespace {

TEST(Words, TheNearestIsTheOneWithFewestMistakes) {
  const std::vector<std::string> words = {"bake", "backup", "bench", "--texels-per-metre"};
  EXPECT_EQ(nearest_word("bkae", words), "bake");
  EXPECT_EQ(nearest_word("bke", words), "bake");
  EXPECT_EQ(nearest_word("bakee", words), "bake");
  EXPECT_EQ(nearest_word("bakcup", words), "backup");
  EXPECT_EQ(nearest_word("--texel-per-meter", words), "--texels-per-metre");
  EXPECT_EQ(nearest_word("xyzzy", words), "");
  EXPECT_EQ(nearest_word("", words), "");
  EXPECT_EQ(nearest_word("bake", {}), "");
}

class Typed : public testing::Test {
 protected:
  CommandResult kiln(const std::string& arguments) { return run_kiln(dir_.path(), arguments); }
  TempDir dir_;
};

TEST_F(Typed, MistakesAreNamedAndAnswered) {
  struct Case {
    const char *typed, *said;
  };
  for (const Case& c :
       {Case{"bkae", "there is no command 'bkae': did you mean 'bake'?"},
        Case{"zzz", "there is no command 'zzz' (`kiln help` lists them)"},
        Case{"help bkae", "there is no command 'bkae': did you mean 'bake'?"},
        Case{"", "a command is missing (`kiln help` shows more)"},
        Case{"--versoin", "kiln has no option --versoin: did you mean '--version'?"},
        Case{"bake x.gltf --texel-per-metre 4",
             "`kiln bake` has no option --texel-per-metre: did you mean '--texels-per-metre'? "
             "(`kiln help bake` shows more)"},
        Case{"jobs 1 2", "`kiln jobs` does not take '2'"},
        Case{"completion tcsh", "'tcsh': there is completion for bash, zsh and fish"}}) {
    const CommandResult result = kiln(c.typed);
    EXPECT_EQ(result.exit_status, 2) << c.typed;
    EXPECT_NE(result.output.find(c.said), std::string::npos) << result.output;
  }
}

TEST_F(Typed, HelpAndVersionAreCommandsToo) {
  EXPECT_EQ(kiln("version").output, kiln("--version").output);
  EXPECT_EQ(kiln("help").output, kiln("--help").output);
  EXPECT_EQ(kiln("help encode").output, kiln("encode --help").output);
  EXPECT_EQ(kiln("help encode").exit_status, 0);
}

// Names of all commands, as `kiln help` lists them.
std::vector<std::string> listed(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream in(help.substr(help.find("Subcommands:")));
  std::string line;
  for (std::getline(in, line); std::getline(in, line) && line.starts_with("  ");) {
    if (line[2] == ' ') continue;  // a text that goes on
    names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

// Long options of one command, as its help lists them.
std::vector<std::string> options_in(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream in(help);
  for (std::string line; std::getline(in, line);) {
    const size_t at = line.find("--");
    if (!line.starts_with("  -") || at > 6) continue;
    names.push_back(line.substr(at, line.find_first_of(" ,", at) - at));
  }
  return names;
}

TEST_F(Typed, ShellsAndManualsKnowEveryCommandAndOption) {
  ASSERT_EQ(kiln("manual-pages -o man").exit_status, 0);
  const auto page = [&](const std::string& name) {
    std::ifstream in(dir_.path() / "man" / (name + ".1"));
    std::stringstream content;
    content << in.rdbuf();
    return content.str();
  };
  const auto scripts = {kiln("completion bash").output, kiln("completion zsh").output,
                        kiln("completion fish").output};
  const std::vector<std::string> commands = listed(kiln("help").output);
  ASSERT_GT(commands.size(), 15u);
  for (const std::string& command : commands) {
    EXPECT_NE(page("kiln").find(command), std::string::npos) << command;
    const std::vector<std::string> options = options_in(kiln("help " + command).output);
    EXPECT_FALSE(options.empty());
    for (const std::string& option : options) {
      if (option == "--help") continue;
      std::string dashes;
      for (const char c : option) dashes += c == '-' ? "\\-" : std::string(1, c);
      EXPECT_NE(page("kiln-" + command).find(dashes), std::string::npos) << command << " " << option;
      for (const std::string& script : scripts)
        EXPECT_NE(script.find(option.substr(2)), std::string::npos) << command << " " << option;
    }
  }
  for (const char* hidden : {"check-scene", "manual-pages"})
    for (const std::string& script : scripts) EXPECT_EQ(script.find(hidden), std::string::npos);
}

TEST_F(Typed, BashCompletesCommandsOptionsAndFiles) {
  const auto completed = [&](const std::string& words, int at) {
    std::ofstream(dir_.path() / "ask.sh") << "source ./script; COMP_WORDS=(" << words
                                          << "); COMP_CWORD=" << at << "; _kiln; echo \"${COMPREPLY[*]}\"";
    return run_command("cd " + dir_.path().string() + " && bash ask.sh").output;
  };
  std::ofstream(dir_.path() / "script") << kiln("completion bash").output;
  std::ofstream(dir_.path() / "room.glb") << "x";
  EXPECT_EQ(completed("kiln enc", 1), "encode\n");
  EXPECT_EQ(completed("kiln bake --texels", 2), "--texels-per-metre\n");
  EXPECT_EQ(completed("kiln help prio", 2), "priority\n");
  EXPECT_EQ(completed("kiln bake roo", 2), "room.glb\n");
}

}  // namespace
}  // namespace kiln::test
