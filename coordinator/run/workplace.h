// Where the units of a bake are done: the farm that the request names, or one of its own.
#pragma once

#include "coordinator/run/bake_run.h"

namespace kiln {

// Everything workers need for a bake: scene, layout and transport settings; `chunks` receives the first two.
Expected<JobSpec> make_job(const Preflight& preflight, const BakeSettings& settings, ChunkStore& chunks);

// Its transport settings alone, for light on receivers of any kind.
Expected<JobSpec> make_transport(const BakeSettings& settings);

class Workplace {
 public:
  explicit Workplace(const BakeRequest& request) : request_(request) {}  // must outlive this

  // Ends the previous job, if any. The bake's own farm starts with the first job and stays.
  // `chunks` must outlive the job.
  Expected<FarmJob*> open(JobSpec spec, const ChunkStore& chunks);
  void close() { job_.reset(); }

 private:
  const BakeRequest& request_;
  uint64_t jobs_ = 0;
  std::unique_ptr<Farm> farm_;
  std::unique_ptr<FarmJob> job_;  // destroyed before its farm
};

}  // namespace kiln
