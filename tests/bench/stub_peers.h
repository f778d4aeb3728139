// Many workers in one process that bake nothing: they speak the wire's protocol and answer every unit with
// zeros.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <vector>

namespace kiln::bench {

struct PeerPlan {
  uint32_t peers = 64, threads = 1, credits = 3;
  uint32_t planes = 1;
  uint64_t measured = ~uint64_t{0};  // units; at the end of a pass a worker waits because there is none
  double unit_ms = 0;                // a unit takes so long on one of these workers; 0: no time at all
  bool reconnect = false;            // once all are welcome, all drop their connections at once and come back
  double seconds = 0;                // 0: until the coordinator says goodbye
};

struct PeerFigures {  // sent as it is through a pipe
  uint64_t welcomed = 0, units = 0, results = 0;
  double all_welcome_s = 0;                                  // first connect to the last Welcome
  double reconnected_s = 0;                                  // all dropped, to the last Welcome
  double first_unit_at_s = 0;                                // steady clock
  double p50_ms = 0, p99_ms = 0, p999_ms = 0, worst_ms = 0;  // a result is sent, to the next unit received
};

double steady_seconds();  // the same clock in all processes of the machine

// A child process that runs the plan. Fork before threads exist; `begin` gives it the port.
class StubPeers {
 public:
  explicit StubPeers(const PeerPlan& plan);
  ~StubPeers();
  void begin(uint16_t port);
  void wait_until_welcome();  // all of them, also the second time
  PeerFigures figures();      // waits for the end of the child

 private:
  pid_t child_ = -1;
  int to_child_ = -1, from_child_ = -1;
};

}  // namespace kiln::bench
