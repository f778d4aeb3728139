// Contracts between our own functions, checked in release builds too: one condition each.
#pragma once

namespace kiln {
[[noreturn]] void check_failed(const char* condition, const char* file, int line);
}

#define KILN_CHECK(condition) \
  (static_cast<bool>(condition) ? void(0) : ::kiln::check_failed(#condition, __FILE__, __LINE__))
