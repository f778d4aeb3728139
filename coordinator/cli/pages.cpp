#include "coordinator/cli/pages.h"

#include <algorithm>
#include <sstream>

#include "common/base/format.h"
#include "common/base/release.h"

namespace kiln {
namespace {

std::vector<const Command*> shown(const std::vector<Command>& commands) {
  std::vector<const Command*> list;
  for (const Command& command : commands)
    if (!command.hidden) list.push_back(&command);
  return list;
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : " ") + word;
  return all;
}

std::string command_names(const std::vector<Command>& commands) {
  std::vector<std::string> names;
  for (const Command* command : shown(commands)) names.push_back(command->name);
  return joined(names);
}

// In single quotes of a shell.
std::string quoted(const std::string& words) {
  std::string all = "'";
  for (const char c : words) all += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return all + "'";
}

std::string bash_completion(const std::vector<Command>& commands) {
  std::string cases;
  for (const Command* command : shown(commands))
    cases += text("    {}) options='--help {}' ;;\n", command->name, joined(long_options(*command)));
  return text(R"(# bash completion of kiln
_kiln() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} options=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{} help version --help --version' -- "$word"))
    return
  fi
  case ${{COMP_WORDS[1]}} in
    help) options='{}' ;;
{}  esac
  case $word in
    -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
    *)
      [ "${{COMP_WORDS[1]}}" = help ] && COMPREPLY=($(compgen -W "$options" -- "$word")) && return
      compopt -o filenames 2>/dev/null
      COMPREPLY=($(compgen -f -- "$word"))
      ;;
  esac
}}
complete -F _kiln kiln ./kiln
)",
              command_names(commands), command_names(commands), cases);
}

// _describe takes NAME:TEXT, in which a colon of the text needs no escape.
std::string zsh_completion(const std::vector<Command>& commands) {
  std::string list, cases;
  for (const Command* command : shown(commands)) {
    list += text("    {}\n", quoted(command->name + ":" + command->about));
    cases += text("    {}) options=(--help {}) ;;\n", command->name, joined(long_options(*command)));
  }
  return text(R"(#compdef kiln
_kiln() {{
  local -a commands options
  commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  case $words[2] in
{}  esac
  if [[ $PREFIX == -* ]]; then compadd -a options; else _files; fi
}}
_kiln "$@"
)",
              list, cases);
}

std::string fish_completion(const std::vector<Command>& commands) {
  std::string all = "# fish completion of kiln\n";
  for (const Command* command : shown(commands)) {
    all += text("complete -c kiln -n __fish_use_subcommand -a {} -d {}\n", command->name,
                quoted(command->about));
    for (const std::string& option : long_options(*command))
      all += text("complete -c kiln -n '__fish_seen_subcommand_from {}' -l {}\n", command->name,
                  option.substr(2));
  }
  return all;
}

// A backslash, a hyphen that is typed, and a dot or quote at the start of a line mean something to troff.
std::string troff(const std::string& words) {
  std::string all;
  for (size_t i = 0; i < words.size(); ++i) {
    const char c = words[i];
    const bool begins = i == 0 || words[i - 1] == '\n';
    if (begins && (c == '.' || c == '\'')) all += "\\&";
    if (c == '\\')
      all += "\\e";
    else if (c == '-')
      all += "\\-";
    else
      all += c;
  }
  return all;
}

std::string heading(const std::string& name, const std::string& about) {
  return text(".TH {} 1 \"\" \"Kiln {}\" \"Kiln\"\n.SH NAME\n{} \\- {}\n", troff(name), release_number(),
              troff(name), troff(about));
}

std::string entry(const std::string& name, const std::string& placeholder, const std::string& about) {
  return text(".TP\n\\fB{}\\fR{}\n{}\n", troff(name),
              placeholder.empty() ? "" : " \\fI" + troff(placeholder) + "\\fR", troff(about));
}

std::string example_lines(const std::string& example) {
  std::string lines;
  std::istringstream in(example);
  for (std::string line; std::getline(in, line);)
    lines += line.substr(std::min(line.size(), line.find_first_not_of(' '))) + "\n";
  return text(".SH EXAMPLES\n.nf\n{}.fi\n", troff(lines));
}

std::string setting_entries() {
  std::string all;
  const BakeSettings defaults;
  for (const Setting& row : settings_table()) {
    const std::string value = row.print(defaults);
    all += entry(text("--{}", row.name), row.value,
                 text("{}{}{}", row.about, *row.unit ? text(" ({})", row.unit) : "",
                      value.empty() ? "" : text(" [{}]", value)));
  }
  return all;
}

}  // namespace

OptionNames names_of(const Option& option) {
  OptionNames names;
  if (option.name.empty() || option.name[0] != '-') {
    names.positional = option.name;
    return names;
  }
  std::istringstream in(option.name);
  for (std::string name; std::getline(in, name, ',');) names.dashed.push_back(name);
  return names;
}

std::vector<std::string> long_options(const Command& command) {
  std::vector<std::string> all;
  for (const Option& option : command.options)
    for (const std::string& name : names_of(option).dashed)
      if (name.starts_with("--")) all.push_back(name);
  if (!command.takes_settings) return all;
  all.push_back("--config");
  for (const Setting& row : settings_table()) all.push_back(std::string("--") + row.name);
  return all;
}

std::string completion_script(const std::string& shell, const std::vector<Command>& commands) {
  if (shell == "bash") return bash_completion(commands);
  if (shell == "zsh") return zsh_completion(commands);
  if (shell == "fish") return fish_completion(commands);
  return {};
}

std::string manual_page(const std::vector<Command>& commands) {
  std::string page = heading("kiln", "bakes lightmaps of glTF scenes, on one machine or many");
  page += ".SH SYNOPSIS\n\\fBkiln\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH COMMANDS\n";
  for (const Command* command : shown(commands)) page += entry(command->name, "", command->about);
  page += entry("help", "[COMMAND]", "Print what a command does and its options");
  page += entry("version", "", "Print the release");
  std::string pages;
  for (const Command* command : shown(commands))
    pages += text("{}.BR kiln\\-{} (1)", pages.empty() ? "" : ",\n", troff(command->name));
  return page + ".SH SEE ALSO\n" + pages + ",\n.BR kiln\\-worker (1)\n";
}

std::string manual_page(const Command& command) {
  std::string page = heading("kiln-" + command.name, command.about);
  page += text(".SH SYNOPSIS\n\\fBkiln {}\\fR [\\fIOPTIONS\\fR]", troff(command.name));
  std::string options;
  for (const Option& option : command.options) {
    const OptionNames names = names_of(option);
    if (!names.positional.empty())
      page += option.required ? text(" \\fI{}\\fR", troff(names.positional))
                              : text(" [\\fI{}\\fR]", troff(names.positional));
    std::string spelled = names.positional;
    for (const std::string& name : names.dashed) spelled += (spelled.empty() ? "" : ", ") + name;
    options += entry(spelled, names.positional.empty() ? option.placeholder : "", option.about);
  }
  page += "\n.SH OPTIONS\n" + options;
  if (command.takes_settings)
    page += ".SH SETTINGS\nA job file (\\fB\\-\\-config\\fR) has the same names, without dashes.\n" +
            setting_entries();
  if (!command.example.empty()) page += example_lines(command.example);
  return page + ".SH SEE ALSO\n.BR kiln (1)\n";
}

}  // namespace kiln
