#include "worker/agent/crash_note.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <memory>

namespace kiln {
namespace {

struct Note {
  const char* file = nullptr;
  const char* text = nullptr;
  size_t size = 0;
};
thread_local Note current;
std::atomic<bool> noted{false};  // only one crash is reported

void say(int fd, const char* text, size_t size) {
  while (size > 0) {
    const ssize_t put = ::write(fd, text, size);
    if (put <= 0) return;
    text += put;
    size -= static_cast<size_t>(put);
  }
}

// Only async-signal-safe calls.
void on_crash(int signal) {
  if (current.file && !noted.exchange(true)) {
    const int fd = ::open(current.file, O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    if (fd >= 0) {
      say(fd, current.text, current.size);
      ::close(fd);
      constexpr char kLine[] = "kiln-worker: error: a unit crashed; to run it alone: kiln-worker --replay ";
      say(STDERR_FILENO, kLine, sizeof kLine - 1);
      say(STDERR_FILENO, current.file, std::strlen(current.file));
      say(STDERR_FILENO, "\n", 1);
    }
  }
  ::raise(signal);  // SA_RESETHAND: now the default action, which ends the process
}

struct CrashStack {
  static constexpr size_t kBytes = 64 << 10;
  CrashStack() : memory(new std::byte[kBytes]) {
    stack_t stack{};
    stack.ss_sp = memory.get();
    stack.ss_size = kBytes;
    ::sigaltstack(&stack, nullptr);
  }
  ~CrashStack() {
    stack_t off{};
    off.ss_flags = SS_DISABLE;
    ::sigaltstack(&off, nullptr);
  }
  std::unique_ptr<std::byte[]> memory;
};

}  // namespace

CrashNote::CrashNote(const std::string& file, const std::string& text) {
  if (!file.empty()) current = {file.c_str(), text.data(), text.size()};
}
CrashNote::~CrashNote() {
  current = {};
}

void catch_crashes() {
  struct sigaction action {};
  action.sa_handler = on_crash;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_ONSTACK;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(signal, &action, nullptr);
}

void use_crash_stack() {
  static thread_local const CrashStack stack;
}

}  // namespace kiln
