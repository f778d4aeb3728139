// Preflight: what a bake will do, what it needs and what it can skip; does not trace rays.
#pragma once

#include <string>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/bake/plan/objects.h"

namespace kiln {

struct ProbePlan {
  uint64_t volumes = 0, probes = 0, inactive = 0;
  double spacing = 0, max_spacing = 0;  // metres; of the finest and the coarsest bricks
  bool visibility = false;
  uint64_t coordinator_bytes = 0, output_bytes = 0;  // estimates
  double least_seconds = 0, most_seconds = 0;        // at BakeSettings::min_samples and most_of_each()
};

struct Plan {
  uint64_t texels = 0, valid_texels = 0;
  uint64_t triangles = 0, stored_triangles = 0;  // of all instances; of distinct meshes
  uint64_t charts = 0;
  uint64_t coordinator_bytes = 0, worker_bytes = 0, output_bytes = 0;  // estimates
  double least_seconds = 0, most_seconds = 0;  // at least_samples and at most_samples, see kRaysPerSecond
  uint32_t least_samples = 0;                  // BakeSettings::least_samples()
  uint32_t most_samples = 0;                   // BakeSettings::most_of_each()
  std::vector<std::string> left_out;           // features this scene does not need, one sentence each
  std::vector<ObjectPlan> objects;             // by instance
  std::vector<std::string> warnings;           // one sentence each
  uint64_t texel_bytes = 0;  // the part of coordinator and worker memory that grows with the texels
  bool cache = false;        // paths may end at measured surfaces
  ProbePlan probes;          // no volumes: none are asked for
};

// Rays per second per thread assumed by the time estimate: the middle of what the benchmark of
// docs/performance.md measures on scenes of 10^4 to 10^6 triangles.
constexpr double kRaysPerSecond = 1.5e6;

// Peak memory per texel during a bake, bytes in coordinator and worker, as measured by tests/bench/memory.py.
struct TexelMemory {
  uint64_t coordinator, worker;
};
TexelMemory texel_memory(const BakeSettings& settings, const Quantities& quantities);

// Why this bake cannot use the irradiance cache; empty: it can, or the cache is off.
std::string why_no_cache(const BakeSettings& settings);

// What a job asks for: the settings' quantities, and the sums of light that --split and a cache take.
Quantities job_quantities(const Scene& scene, const BakeSettings& settings);

Plan make_plan(const Scene& scene, const Atlas& atlas, const BakeSettings& settings, unsigned threads);

}  // namespace kiln
