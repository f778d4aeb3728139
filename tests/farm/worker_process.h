// A real worker process and the coordinator's side of its conversation, played by a test.
#pragma once

#include "coordinator/farm/dispatch/child_process.h"
#include "tests/farm/farm_support.h"
#include "tests/farm/raw_peer.h"

namespace kiln::test {

class WorkerProcess {
 public:
  // The stub worker with one thread and no cache; both can be given.
  explicit WorkerProcess(uint16_t port, const std::vector<std::string>& arguments = {});
  bool ended_with(int status);          // within ten seconds
  bool says(const std::string& words);  // within five seconds
  ChildProcess process;
  std::string said;  // as far as it was read

 private:
  void listen();
};

void serve_chunks(RawPeer& peer, const ChunkStore& chunks, const ChunkRequest& request);

// Waits for Hello and welcomes the worker with a heartbeat of 100 ms.
bool welcome(RawPeer& peer);
// Gives the job and serves chunks until its Credits; adds to `asked` the chunks that were asked for.
std::optional<Credits> give_job(RawPeer& peer, const TestJob& job, size_t* asked = nullptr);
// Both.
std::optional<Credits> make_ready(RawPeer& peer, const TestJob& job, size_t* asked = nullptr);

Unit unit_of(const TestJob& job, uint64_t id);

}  // namespace kiln::test
