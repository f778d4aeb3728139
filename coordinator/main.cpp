#include "coordinator/cli/command.h"

int main(int argc, char** argv) {
  std::vector<kiln::Command> commands{
      kiln::bake_command(),   kiln::encode_command(),     kiln::plan_command(),   kiln::compare_command(),
      kiln::bench_command(),  kiln::cert_command(),       kiln::serve_command(),  kiln::status_command(),
      kiln::submit_command(), kiln::jobs_command(),       kiln::watch_command(),  kiln::fetch_command(),
      kiln::why_command(),    kiln::workers_command(),    kiln::doctor_command(), kiln::view_command(),
      kiln::backup_command(), kiln::check_scene_command()};
  for (kiln::Command& command : kiln::change_commands()) commands.push_back(std::move(command));
  const kiln::Command completion = kiln::completion_command(commands);
  commands.push_back(completion);
  commands.push_back(kiln::manual_pages_command(commands));
  return kiln::run_command_line(argc, argv, commands);
}
