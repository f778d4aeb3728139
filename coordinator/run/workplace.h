// Where the units of a bake are done: a farm that the request names, or one of this bake's own.
#pragma once

#include "coordinator/run/bake_run.h"

namespace kiln {

// What workers need of a bake: its scene, its layout and how light goes; `chunks` gets the first two.
Expected<JobSpec> make_job(const Preflight& preflight, const BakeSettings& settings, ChunkStore& chunks);

class Workplace {
 public:
  explicit Workplace(const BakeRequest& request) : request_(request) {}  // outlives this

  // Ends the job before, if there is one. A farm of this bake's own begins with the first and stays.
  // `chunks` outlives the job.
  Expected<FarmJob*> open(JobSpec spec, const ChunkStore& chunks);
  void close() { job_.reset(); }

 private:
  const BakeRequest& request_;
  uint64_t jobs_ = 0;
  std::unique_ptr<Farm> farm_;
  std::unique_ptr<FarmJob> job_;  // ends before its farm
};

}  // namespace kiln
