// Makes a crash leave a reproduction: while a note exists, a fatal signal on its thread writes the note's
// text to its file and one line to standard error before the process dies.
#pragma once

#include <string>

namespace kiln {

class CrashNote {
 public:
  // Both are used by the signal handler: they must outlive the note. An empty file: no note.
  CrashNote(const std::string& file, const std::string& text);
  ~CrashNote();
  CrashNote(const CrashNote&) = delete;
  CrashNote& operator=(const CrashNote&) = delete;
};

void catch_crashes();    // once for the process: SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT
void use_crash_stack();  // for this thread, so that a stack overflow can also be noted

}  // namespace kiln
