// Everything that an agent needs of the world: a coordinator to connect to, time, a disk, bake threads. The
// socket environment (socket_environment.h) is the real one; tests/agent_sim has one that fails by seed and
// play.h one that repeats a recording. Handlers run from the loop, never from inside a call.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/link.h"
#include "common/wire/timing.h"
#include "worker/agent/bake_pool.h"
#include "worker/agent/ready_job.h"

namespace kiln {

class AgentEnvironment {
 public:
  virtual ~AgentEnvironment() = default;

  virtual Timing& timing() = 0;
  virtual uint64_t draw() = 0;  // random: for instance numbers and the jitter of pauses, never for results
  virtual Hello hello() = 0;    // of this process, without instance
  // Calls `done` once, with a link that is not started. A kUsage error ends the agent; others are tried
  // again.
  virtual void connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) = 0;

  // The work of other threads.
  virtual void classify(const std::string& isa, std::function<void(Expected<std::string>)> done) = 0;
  using Prepared = std::function<void(Expected<std::shared_ptr<const Baker>>)>;
  virtual void prepare(const JobSpec& job, JobChunks chunks, Prepared done) = 0;
  virtual void bake(BakeTask task, std::function<void(const Unit&, Expected<UnitResult>)> done) = 0;
  virtual std::vector<Unit> take_unbegun(const std::function<bool(const Unit&)>& wanted) = 0;  // BakePool's
  virtual size_t queued() const = 0;
  virtual std::optional<BakePool::Begun> oldest() const = 0;

  // The disk cache. `done` gets null for a chunk that is not there.
  virtual bool has_disk() const = 0;
  virtual void look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) = 0;
  virtual void store(const Digest& id, ChunkBytes bytes) = 0;
  virtual std::string replay_file(uint64_t job, uint64_t unit) const = 0;  // its name
  virtual Status keep_replay(const std::string& file, const std::string& content) = 0;

  virtual void touch_alive_file() = 0;  // once a second
};

}  // namespace kiln
