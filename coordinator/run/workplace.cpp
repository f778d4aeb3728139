#include "coordinator/run/workplace.h"

#include "common/base/files.h"
#include "common/base/parallel.h"
#include "common/math/samplers.h"
#include "common/responses/basis.h"
#include "common/scene/prepared.h"
#include "coordinator/bake/plan/plan.h"

namespace kiln {
namespace {

FarmSettings farm_settings(const BakeRequest& request) {
  const BakeSettings& s = request.settings;
  FarmSettings f;
  f.token = random_hex(16);
  f.local_workers = s.workers ? s.workers : 1;
  f.local_threads = s.threads ? s.threads : std::max(1u, hardware_threads() / f.local_workers);
  f.worker_program = request.worker_program.string();
  f.rules.lease_ms = s.lease_ms;
  return f;
}

}  // namespace

Expected<JobSpec> make_transport(const BakeSettings& settings) {
  JobSpec job;
  job.transport.direct = settings.direct;
  job.transport.indirect = settings.indirect;
  job.transport.max_bounces = settings.max_bounces;
  job.transport.seed = settings.seed;
  KILN_TRY(job.transport.sampler, find_sampler(settings.sampler));
  job.transport.watertight = settings.watertight;
  job.transport.isa = settings.isa;
  return job;
}

Expected<JobSpec> make_job(const Preflight& pre, const BakeSettings& settings, ChunkStore& chunks) {
  KILN_TRY(JobSpec job, make_transport(settings));
  job.scene = write_scene(pre.imported.scene, chunks);
  job.atlas = chunks.add(write_atlas(pre.atlas));
  job.transport.basis = basis_index(settings);
  job.transport.quantities = job_quantities(pre.imported.scene, settings);
  job.transport.response = {static_cast<float>(settings.ao_distance), settings.ao_falloff};
  return job;
}

Expected<FarmJob*> Workplace::open(JobSpec spec, const ChunkStore& chunks) {
  close();
  spec.id = ++jobs_;
  if (request_.open_job) {
    KILN_TRY(job_, request_.open_job(spec, chunks));
    return job_.get();
  }
  if (!farm_) {
    KILN_TRY(farm_, Farm::start(farm_settings(request_)));
  }
  JobTraits traits;
  traits.quorum = request_.quorum;
  KILN_TRY(job_, farm_->open_job({spec, &chunks, traits, {}}));
  return job_.get();
}

}  // namespace kiln
