#include "tests/bake/worker_processes.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace kiln::test {

std::set<pid_t> worker_processes() {
  std::set<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string line;
    std::getline(stat, line);
    const size_t close = line.rfind(')');
    if (close == std::string::npos || line.find("(kiln-worker)") == std::string::npos) continue;
    std::istringstream rest(line.substr(close + 2));
    char state;
    pid_t parent;
    rest >> state >> parent;
    if (parent == ::getpid() && state != 'Z') found.insert(static_cast<pid_t>(std::stol(name)));
  }
  return found;
}

pid_t busiest_worker() {
  pid_t busiest = 0;
  uint64_t most = 0;
  for (const pid_t pid : worker_processes()) {
    std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
    std::string line, skipped;
    std::getline(stat, line);
    std::istringstream rest(line.substr(std::min(line.size(), line.rfind(')') + 2)));
    for (int field = 3; field < 14; ++field) rest >> skipped;
    uint64_t ticks = 0;  // field 14 of proc(5): on a processor, of all threads
    if (!(rest >> ticks) || (busiest != 0 && ticks <= most)) continue;
    busiest = pid;
    most = ticks;
  }
  return busiest;
}

}  // namespace kiln::test
