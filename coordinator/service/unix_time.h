// For records that people read; decides nothing but ages in days.
#pragma once

#include <chrono>
#include <cstdint>

namespace kiln {

inline int64_t unix_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace kiln
