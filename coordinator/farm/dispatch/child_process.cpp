#include "coordinator/farm/dispatch/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/format.h"

extern char** environ;

namespace kiln {
namespace {

constexpr size_t kMaxLine = 1000;

std::vector<char*> pointers(const std::vector<std::string>& strings) {
  std::vector<char*> p;
  for (const std::string& s : strings) p.push_back(const_cast<char*>(s.c_str()));
  p.push_back(nullptr);
  return p;
}

std::vector<std::string> environment_with(const std::vector<std::string>& added) {
  std::vector<std::string> all = added;
  for (char** e = environ; *e; ++e) {
    const std::string entry = *e;
    const std::string name = entry.substr(0, entry.find('=') + 1);
    bool replaced = false;
    for (const std::string& a : added) replaced = replaced || a.rfind(name, 0) == 0;
    if (!replaced) all.push_back(entry);
  }
  return all;
}

}  // namespace

Expected<ChildProcess> ChildProcess::spawn(const std::vector<std::string>& command,
                                           const std::vector<std::string>& environment) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    return fail(ErrorKind::kIo, text("cannot make a pipe: {}", std::strerror(errno)));
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, ends[1], 1);
  posix_spawn_file_actions_adddup2(&files, ends[1], 2);
  posix_spawn_file_actions_addclosefrom_np(&files, 3);
  // Signals blocked or ignored here must work in the child.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const std::vector<std::string> variables = environment_with(environment);
  ChildProcess child;
  const int code = ::posix_spawn(&child.pid_, command[0].c_str(), &files, &attributes,
                                 pointers(command).data(), pointers(variables).data());
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  ::close(ends[1]);
  child.output_ = ends[0];
  if (code != 0) return fail(ErrorKind::kIo, text("cannot start {}: {}", command[0], std::strerror(code)));
  child.reaped_ = false;
  return child;
}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(output_, other.output_);
  std::swap(reaped_, other.reaped_);
  std::swap(wait_status_, other.wait_status_);
  std::swap(partial_, other.partial_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (running()) {
    signal(SIGKILL);
    while (::waitpid(pid_, &wait_status_, 0) < 0 && errno == EINTR) {
    }
  }
  if (output_ >= 0) ::close(output_);
}

bool ChildProcess::running() {
  if (reaped_) return false;
  const pid_t got = ::waitpid(pid_, &wait_status_, WNOHANG);
  if (got == pid_ || (got < 0 && errno == ECHILD)) reaped_ = true;
  return !reaped_;
}

void ChildProcess::signal(int number) {
  if (!reaped_) ::kill(pid_, number);
}

std::vector<std::string> ChildProcess::read_lines() {
  std::vector<std::string> lines;
  std::array<char, 4096> buffer;
  for (ssize_t got; output_ >= 0 && (got = ::read(output_, buffer.data(), buffer.size())) > 0;)
    for (const char c : std::string_view(buffer.data(), static_cast<size_t>(got))) {
      if (c != '\n') partial_ += c;
      if (c == '\n' || partial_.size() >= kMaxLine) lines.push_back(std::exchange(partial_, {}));
    }
  if (reaped_ && !partial_.empty()) lines.push_back(std::exchange(partial_, {}));
  return lines;
}

bool ChildProcess::exited_with(int status) const {
  return reaped_ && WIFEXITED(wait_status_) && WEXITSTATUS(wait_status_) == status;
}

std::string ChildProcess::how_it_ended() const {
  if (WIFSIGNALED(wait_status_))
    return text("signal {} ({})", WTERMSIG(wait_status_), ::strsignal(WTERMSIG(wait_status_)));
  return text("exit status {}", WEXITSTATUS(wait_status_));
}

}  // namespace kiln
