// Units of work (texels, sample range) and their results.
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

// How emissive triangles and the environment image are sampled: by light sampling and paths with MIS, or by
// one of the two. Other lights have one strategy, which always applies.
enum class MisMode { kBoth, kLights, kPaths };

// Settings shared by every unit of a job; sent once. Everything that affects a byte of the result is here or
// in the unit.
struct TransportSettings {
  uint32_t basis = 1;  // index into basis_roster()
  Quantities quantities{};
  ResponseSettings response{};
  bool direct = true, indirect = true;
  uint32_t max_bounces = 64;
  uint64_t seed = 0;
  Sampler sampler = Sampler::kOwen;
  bool watertight = false;   // no ray slips between triangles that share an edge; slower
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

// Independent halves of every texel's samples; their difference measures the error.
constexpr uint32_t kReplicates = 2;

// Sums over samples [first_sample, first_sample + sample_count) of each listed texel site. The result
// does not depend on how a pass is cut into units: every texel's sums stand alone.
struct WorkUnit {
  uint64_t id = 0;  // unique in the job
  uint32_t first_sample = 0, sample_count = 0;
  std::vector<uint32_t> sites{};  // indices into TexelSites
  uint32_t replicate = 0;         // below kReplicates: selects the random sequence of the samples
  Digest cache{};                 // irradiance cache that paths end at (irradiance_cache.h); zero: none
};

// Hash of everything but the id: a result of another shape belongs to another unit. Ids change their meaning
// when a job is rewound, or cut by another release.
uint64_t unit_shape(const WorkUnit& unit);

struct UnitResult {
  uint64_t unit = 0;
  uint32_t site_count = 0, plane_count = 0;
  std::vector<double> moments;                         // [site][plane], planes of MomentLayout
  uint64_t rays = 0;                                   // all rays traced
  uint64_t nonfinite = 0;                              // samples with a contribution dropped: not finite
  uint32_t nonfinite_texel = 0, nonfinite_sample = 0;  // the first such sample, for replay
  double seconds = 0;                                  // of one thread; for the report only
};

// Serialises a whole result for storage; reading checks sizes.
Bytes write_result(const UnitResult& result);
Expected<UnitResult> read_result(std::span<const std::byte> bytes);

// SHA-256 of everything that must agree when a unit is computed twice: ids, shape and moments, not times.
Digest result_digest(const UnitResult& result);

}  // namespace kiln
