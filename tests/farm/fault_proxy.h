// Stands between a worker and its coordinator, both on loopback, and breaks what the worker itself never
// would. Lives as long as the process.
#pragma once

#include <cstdint>

namespace kiln::test {

struct WireFaults {
  uint32_t copies = 1;         // of each Result
  uint32_t flip_every = 0;     // one bit of every n-th frame to the coordinator
  uint32_t version = 0;        // of the frames to the coordinator; 0: as they are
  bool drop_withdraw = false;  // the worker never hears a Withdraw
  bool drop_acks = false;      // nor a CommitAck
};

// Returns the port that the worker connects to instead of `port`.
uint16_t start_fault_proxy(uint16_t port, const WireFaults& faults);

}  // namespace kiln::test
