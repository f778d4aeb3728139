// References: bakes of one scene with many samples, in two independent halves, cached by their
// inputs.
#pragma once

#include <filesystem>

#include "coordinator/measure/compare/error_map.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

struct ReferenceRequest {
  std::filesystem::path scene;
  BakeSettings settings;     // only those that change the light matter: see reference_settings
  uint32_t samples = 16384;  // per texel, in each half
  // Share of the texels to bake, in blocks of 8 x 8 that a hash selects: maps of millions of
  // texels need no more. 1: all.
  double share = 1;
  // Above 0: a texel gets from `samples` / kLeastShare to `samples`, as this error of the map asks
  // (mean-square). Dark texels, whose light comes by few paths, need many times more than others. The rule
  // sees the samples it counts, so a texel that has met no rare light yet may stop too early: hence the
  // least.
  double error = 0;
  bool cache = false;            // paths may end at measured surfaces: for light that whole paths hardly find
  std::filesystem::path folder;  // cache of references; created if needed
  std::filesystem::path worker_program;
};

struct Reference {
  std::string key;  // SHA-256 of scene, atlas, settings that change the light, samples and release
  std::filesystem::path folder;  // has half0 and half1, each with irradiance.exr and validity.exr
  ErrorMap half[2];
  bool reused = false;
  double seconds = 0;  // spent by this call
};

// Settings of the halves: the scene, layout and transport of `settings`, without anything that
// trades exactness for time: no cache, no denoiser, no joined seams, a fixed sample count (unless
// `error` asks for another); with seeds that no measured run has. `cache`: keep the irradiance cache,
// whose bias is measured separately (docs/error_vs_time.md).
BakeSettings reference_settings(const ReferenceRequest& request, uint32_t half);
constexpr uint32_t kLeastShare = 16;

// Whether a block of 8 x 8 texels is baked. The same in both halves and in every reference with
// that share; a smaller share is a subset of a larger one. Errors of nearby texels are correlated, so that
// many small blocks represent a map better than a few large ones; SSIM needs some context (its windows are 11
// texels wide).
constexpr uint32_t kReferenceBlock = 8;
bool is_reference_block(uint32_t column, uint32_t row, double share);

// $KILN_CACHE/references or equivalent (unwrap_cache.h); empty if there is none.
std::filesystem::path default_reference_folder();

// The cached reference, or a new one, which is then cached. Fails (kInvalidInput) on a damaged one,
// naming the file and what to do.
Expected<Reference> obtain_reference(const ReferenceRequest& request,
                                     const std::function<void(const BakeProgress&)>& progress);

}  // namespace kiln
