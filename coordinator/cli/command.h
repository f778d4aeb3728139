// Sub-commands: each declares its options on a parser and runs its body after parsing.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/job/settings.h"

namespace kiln {

// An option of a sub-command. Values are strings; the settings table or the command checks them.
struct Option {
  std::string name;         // "--workers", "-o,--output", or "scene" for a positional
  std::string placeholder;  // "N"; empty: a flag
  std::string about;
  bool required = false;
  bool several = false;  // may be repeated: the value holds all of them, one per line
};

// The parsed command line.
struct Arguments {
  std::vector<std::pair<std::string, std::string>>
      values;  // option name without dashes (its long form), value
  bool has(const std::string& name) const;
  std::string get(const std::string& name, const std::string& fallback = "") const;
};

struct Command {
  std::string name, about, example;
  std::vector<Option> options;
  bool takes_settings = false;  // every row of settings_table() is an option, and --config
  std::function<int(const Arguments&, const BakeSettings&)> run;  // exit status
  bool scene_job_file = true;  // read SCENE.kiln.json; false: another source has the same settings
  bool hidden = false;         // not listed: this program runs it itself
};

// Parses the command line and runs the command. Wrong usage: a message on standard error and 2.
int run_command_line(int argc, char** argv, const std::vector<Command>& commands);

// The commands of this program, one file each.
Command backup_command();
Command bake_command();
Command encode_command();
Command plan_command();
Command compare_command();
Command bench_command();
Command cert_command();
Command doctor_command();
Command serve_command();
Command check_scene_command();
Command status_command();
Command submit_command();
Command jobs_command();
Command watch_command();
Command fetch_command();
Command why_command();
Command workers_command();
Command view_command();
// Of all the others.
Command completion_command(const std::vector<Command>& commands);
Command manual_pages_command(const std::vector<Command>& commands);
std::vector<Command> change_commands();  // cancel, pause, resume, retry, priority, forget

// Prints "kiln: ..." on standard error and returns the exit status of the error.
int report_error(const Error& error);
// Path of kiln-worker beside this program.
std::string worker_program();

}  // namespace kiln
