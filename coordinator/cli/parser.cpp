// The only CLI11 include.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/printable.h"
#include "common/base/release.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/pages.h"
#include "coordinator/cli/suggest.h"

namespace kiln {
namespace {

// "-o,--output" -> "output", "scene" -> "scene".
std::string long_name(const std::string& name) {
  const size_t dashes = name.rfind("--");
  return dashes == std::string::npos ? name : name.substr(dashes + 2);
}

struct Parsed {
  CLI::App* app;
  const Command* command;
  std::vector<std::pair<std::string, std::string>> values;
  std::vector<std::pair<std::string, bool>> flags;
  std::string config;
  std::vector<std::vector<std::string>> settings;  // by row of the table
};

void declare(Parsed& p) {
  p.values.reserve(p.command->options.size());
  p.flags.reserve(p.command->options.size());
  for (const Option& o : p.command->options) {
    if (o.placeholder.empty() && o.name[0] == '-') {
      p.flags.emplace_back(long_name(o.name), false);
      p.app->add_flag(o.name, p.flags.back().second, o.about);
      continue;
    }
    p.values.emplace_back(long_name(o.name), "");
    CLI::Option* const option = p.app->add_option(o.name, p.values.back().second, o.about)
                                    ->type_name(o.placeholder)
                                    ->required(o.required);
    if (o.several) option->multi_option_policy(CLI::MultiOptionPolicy::Join);
  }
  if (!p.command->takes_settings) return;
  p.app
      ->add_option(
          "--config", p.config,
          "JSON job file; the command line overrides it [SCENE.kiln.json beside the scene, if it is there]")
      ->type_name("FILE");
  p.settings.resize(settings_table().size());
  const BakeSettings defaults;
  for (size_t i = 0; i < settings_table().size(); ++i) {
    const Setting& row = settings_table()[i];
    const std::string value = row.print(defaults);
    // One value per use, as a word: a leading minus belongs to the value.
    p.app
        ->add_option(std::string("--") + row.name, p.settings[i],
                     text("{}{}{}", row.about, value.empty() ? "" : " [" + value + "]",
                          *row.unit ? text(" ({})", row.unit) : ""))
        ->type_name(row.value)
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->group("Settings");
  }
}

Status read_config(const std::string& path, BakeSettings& settings) {
  KILN_TRY(const Bytes bytes, read_file(path, 1 << 20));
  const auto pairs = parse_flat_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!pairs) return fail(ErrorKind::kUsage, text("{}: {}", path, pairs.error().message));
  for (const auto& [key, value] : *pairs)
    if (Status s =
            set_option(settings, key, value, "job file " + std::filesystem::path(path).filename().string());
        !s)
      return fail(ErrorKind::kUsage, text("{}: {}", path, s.error().message));
  return {};
}

// NAME.kiln.json beside NAME.gltf is the scene's own job file, unless --config names another.
std::string job_file_of(const Parsed& p, const Arguments& arguments) {
  if (!p.config.empty() || !p.command->takes_settings || !p.command->scene_job_file ||
      !arguments.has("scene"))
    return p.config;
  const std::filesystem::path beside =
      std::filesystem::path(arguments.get("scene")).replace_extension(".kiln.json");
  std::error_code code;
  // Whatever is there: reading it says what is wrong with a pipe or a link to nowhere.
  return std::filesystem::exists(std::filesystem::symlink_status(beside, code)) ? beside.string()
                                                                                : std::string();
}

Expected<BakeSettings> gather_settings(const Parsed& p, const Arguments& arguments) {
  BakeSettings settings;
  if (const std::string file = job_file_of(p, arguments); !file.empty()) {
    KILN_TRY_STATUS(read_config(file, settings));
    std::fprintf(stderr, "settings from %s\n", file.c_str());
  }
  for (size_t i = 0; i < p.settings.size(); ++i) {
    const std::string name = settings_table()[i].name;
    // Lists on the command line replace those of the job file.
    if (!p.settings[i].empty() && name == "sun") settings.suns.clear();
    if (!p.settings[i].empty() && name == "importance-box") settings.importance_boxes.clear();
    for (const std::string& value : p.settings[i])
      KILN_TRY_STATUS(set_option(settings, name, value, "command line"));
  }
  KILN_TRY_STATUS(check_settings(settings));
  return settings;
}

int run_parsed(const Parsed& p) {
  Arguments arguments;
  for (const auto& [name, value] : p.values)
    if (!value.empty()) arguments.values.emplace_back(name, value);
  for (const auto& [name, on] : p.flags)
    if (on) arguments.values.emplace_back(name, "");
  const auto settings = gather_settings(p, arguments);
  if (!settings) return report_error(settings.error());
  if (!p.config.empty()) arguments.values.emplace_back("config", p.config);
  return p.command->run(arguments, *settings);
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string meant = nearest_word(word, candidates);
  return meant.empty() ? "" : text(": did you mean '{}'?", meant);
}

// `kiln help [COMMAND]` and `kiln version` say the same as the options; a word in the first place that is no
// command is named. What it returns ends the program.
std::optional<int> settle_first_word(std::vector<std::string>& words, const std::vector<Command>& commands) {
  if (words.empty() || words[0].starts_with("-")) return {};
  std::vector<std::string> names = {"help", "version"};
  const auto is_known = [&](const std::string& word) {
    return std::any_of(commands.begin(), commands.end(), [&](const Command& c) { return c.name == word; });
  };
  for (const Command& c : commands)
    if (!c.hidden) names.push_back(c.name);
  if (words[0] == "version" && words.size() == 1) {
    words = {"--version"};
  } else if (words[0] == "help") {
    words.erase(words.begin());
    words.resize(std::min<size_t>(words.size(), 1));
    words.push_back("--help");
  }
  if (words[0].starts_with("-") || is_known(words[0])) return {};
  return report_error({ErrorKind::kUsage, text("there is no command '{}'{} (`kiln help` lists them)",
                                               words[0], did_you_mean(words[0], names))});
}

// What CLI11 says of a wrong command line; before that, words that it does not know, and what may have been
// meant.
int explain_usage(const CLI::App& app, const CLI::ParseError& error,
                  const std::vector<std::unique_ptr<Parsed>>& all) {
  const Parsed* used = nullptr;
  for (const auto& p : all)
    if (p->app->parsed()) used = p.get();
  const std::vector<std::string> left = (used ? used->app : &app)->remaining();
  std::string said = error.what();
  const std::string program = used ? text("`kiln {}`", used->command->name) : "kiln";
  if (!left.empty()) {
    const std::string word = left[0].substr(0, left[0].find('='));
    const std::vector<std::string> options =
        used ? long_options(*used->command) : std::vector<std::string>{"--help", "--version"};
    said = word.starts_with("-") ? text("{} has no option {}{}", program, word, did_you_mean(word, options))
                                 : text("{} does not take '{}'", program, word);
  } else if (!used) {
    said = "a command is missing";
  }
  return report_error({ErrorKind::kUsage,
                       text("{} (`kiln help{}` shows more)", said, used ? " " + used->command->name : "")});
}

}  // namespace

bool Arguments::has(const std::string& name) const {
  for (const auto& [key, value] : values)
    if (key == name) return true;
  return false;
}

std::string Arguments::get(const std::string& name, const std::string& fallback) const {
  for (const auto& [key, value] : values)
    if (key == name) return value;
  return fallback;
}

int report_error(const Error& error) {
  std::fprintf(stderr, "kiln: %s\n", printable(error.message).c_str());
  return exit_status(error);
}

std::string worker_program() {
  std::error_code code;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", code);
  return (self.parent_path() / "kiln-worker").string();
}

int run_command_line(int argc, char** argv, const std::vector<Command>& commands) {
  CLI::App app("Kiln bakes lightmaps of glTF scenes, on one machine or many.");
  app.require_subcommand(1);
  app.set_version_flag("--version", "kiln " + release_number());
  std::vector<std::unique_ptr<Parsed>> all;
  for (const Command& c : commands) {
    CLI::App* sub = app.add_subcommand(c.name, c.about);
    sub->footer("Example:\n  " + c.example);
    if (c.hidden) sub->group("");
    all.push_back(std::make_unique<Parsed>(Parsed{sub, &c, {}, {}, {}, {}}));
    declare(*all.back());
  }
  std::vector<std::string> words(argv + 1, argv + std::max(argc, 1));
  if (const auto status = settle_first_word(words, commands)) return *status;
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
    app.name(argc > 0 ? argv[0] : "kiln");
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() != 0) return explain_usage(app, e, all);
    return app.exit(e);  // --help, --version
  }
  try {
    for (const auto& p : all)
      if (p->app->parsed()) return run_parsed(*p);
  } catch (const std::bad_alloc&) {
    return report_error(
        {ErrorKind::kNoSpace,
         "memory ran out: close other programs, or give it less to do (a smaller scene, a lower "
         "--texels-per-metre)"});
  } catch (const std::exception& e) {
    return report_error(
        {ErrorKind::kInternal, text("{}: an error that should not be: please report it", e.what())});
  }
  return 2;
}

}  // namespace kiln
