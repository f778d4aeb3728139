// A child process whose standard output and error are read line by line.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

class ChildProcess {
 public:
  // `environment` is added to ours ("NAME=value"). Standard input is empty; no other descriptor of ours
  // is inherited.
  static Expected<ChildProcess> spawn(const std::vector<std::string>& command,
                                      const std::vector<std::string>& environment);
  ChildProcess() = default;
  ~ChildProcess();  // kills and reaps the process if it still runs
  ChildProcess(ChildProcess&& other) noexcept { *this = std::move(other); }
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  bool running();  // reaps the process if it has ended
  void signal(int number);
  std::vector<std::string> read_lines();  // complete lines so far; everything once the process has ended
  pid_t pid() const { return pid_; }
  bool exited_with(int status) const;
  std::string how_it_ended() const;  // "exit status 2", "signal 11 (Segmentation fault)"

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  bool reaped_ = true;
  int wait_status_ = 0;
  std::string partial_;  // a line not yet ended
};

}  // namespace kiln
