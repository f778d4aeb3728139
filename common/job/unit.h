// The work: (texels, sample range) units, and what comes back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/hash.h"
#include "common/base/status.h"
#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "common/responses/quantities.h"

namespace kiln {

// By what emissive triangles and the environment's image are found: both, weighted against each other, or one
// alone. Other lights have one way only, which stays.
enum class MisMode { kBoth, kLights, kPaths };

// What every unit of a job shares; shipped once. Everything that decides a byte of the result is here or
// in the unit.
struct TransportSettings {
  uint32_t basis = 1;  // index into basis_roster()
  Quantities quantities{};
  ResponseSettings response{};
  bool direct = true, indirect = true;
  uint32_t max_bounces = 64;
  uint64_t seed = 0;
  Sampler sampler = Sampler::kOwen;
  bool watertight = false;   // no ray passes between triangles that share an edge; slower
  std::string isa = "avx2";  // Embree's kernels: "sse2", "sse4.2", "avx", "avx2", "avx512"
  PrimaryDensity primary = PrimaryDensity::kMixed;  // not sent: tests/bench/convergence.cpp alone changes it
  MisMode mis_mode = MisMode::kBoth;                // not sent: tests/equivalence alone changes it
};

struct JobSpec {
  uint64_t id = 0;
  Digest scene;  // structure chunk
  Digest atlas;  // atlas chunk
  TransportSettings transport;
};

Bytes write_job(const JobSpec& job);
Expected<JobSpec> read_job(std::span<const std::byte> bytes);

// Independent halves of every texel's samples: what they differ by is the error.
constexpr uint32_t kReplicates = 2;

// Sums over samples [first_sample, first_sample + sample_count) of each listed texel site. The result
// does not depend on how a pass is cut into units: every texel's sums stand alone.
struct WorkUnit {
  uint64_t id = 0;  // unique in the job
  uint32_t first_sample = 0, sample_count = 0;
  std::vector<uint32_t> sites{};  // indices into TexelSites
  uint32_t replicate = 0;         // below kReplicates: the sequence of random numbers that the samples are of
  Digest cache{};                 // irradiance cache that paths end at (irradiance_cache.h); zero: none
};

// Of all but the id: a result of another shape is another unit's. What ids stand for changes when a job is
// rewound, or cut by another release.
uint64_t unit_shape(const WorkUnit& unit);

struct UnitResult {
  uint64_t unit = 0;
  uint32_t site_count = 0, plane_count = 0;
  std::vector<double> moments;                         // [site][plane], planes of MomentLayout
  uint64_t rays = 0;                                   // all rays traced
  uint64_t nonfinite = 0;                              // samples with a contribution dropped: not finite
  uint32_t nonfinite_texel = 0, nonfinite_sample = 0;  // the first of them, to replay
  double seconds = 0;                                  // of one thread; for the report only
};

// All of a result as bytes, to keep it; reading checks sizes.
Bytes write_result(const UnitResult& result);
Expected<UnitResult> read_result(std::span<const std::byte> bytes);

// SHA-256 of what must be equal when a unit is answered twice: ids, shape and moments, not the times.
Digest result_digest(const UnitResult& result);

}  // namespace kiln
