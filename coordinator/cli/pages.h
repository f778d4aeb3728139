// Texts about the commands for other programs, made from the same roster that the parser reads: completion of
// shells and manual pages.
#pragma once

#include <string>
#include <vector>

#include "coordinator/cli/command.h"

namespace kiln {

// An option as its reader types it: "--output" and "-o", or a positional's name.
struct OptionNames {
  std::vector<std::string> dashed;  // empty for a positional
  std::string positional;
};
OptionNames names_of(const Option& option);

// Every long option of the command with dashes, the settings among them.
std::vector<std::string> long_options(const Command& command);

// For bash, zsh or fish; empty for another shell. Hidden commands are left out, here and below.
std::string completion_script(const std::string& shell, const std::vector<Command>& commands);

// troff (man-pages(7)) of `kiln` itself, and of one command, kiln-NAME(1).
std::string manual_page(const std::vector<Command>& commands);
std::string manual_page(const Command& command);

}  // namespace kiln
