#include "coordinator/cli/command.h"

int main(int argc, char** argv) {
  return kiln::run_command_line(argc, argv,
                                {kiln::bake_command(), kiln::plan_command(), kiln::compare_command(),
                                 kiln::cert_command(), kiln::doctor_command()});
}
