// References: bakes of one scene as exact as samples make them, in two independent halves, kept by what went
// into them.
#pragma once

#include <filesystem>

#include "coordinator/measure/compare/error_map.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

struct ReferenceRequest {
  std::filesystem::path scene;
  BakeSettings settings;     // those that say what the light is count: see reference_settings
  uint32_t samples = 16384;  // of every texel, in each half
  // Of the texels, those of blocks of 16 x 16 that a hash picks: maps of millions of texels need no more to
  // be measured by. 1: all.
  double share = 1;
  bool cache = false;            // paths may end at measured surfaces: for light that whole paths hardly find
  std::filesystem::path folder;  // where references are kept; made if needed
  std::filesystem::path worker_program;
};

struct Reference {
  std::string key;  // SHA-256 of scene, atlas, settings that change the light, samples and release
  std::filesystem::path folder;  // has half0 and half1, each with irradiance.exr and validity.exr
  ErrorMap half[2];
  bool reused = false;
  double seconds = 0;  // that this call took
};

// What the halves are baked with: the scene, layout and transport of `settings`, and nothing that trades
// exactness for time: no cache, no denoiser, no seams joined, a fixed count of samples; seeds that no
// measured run has.
// `cache`: but for the irradiance cache, whose bias is measured apart (docs/error_vs_time.md).
BakeSettings reference_settings(BakeSettings settings, uint32_t samples, bool cache, uint32_t half);

// Is a block of 16 x 16 texels of those that are baked? Alike in both halves and in every reference of a
// share; a smaller share is a part of a larger one.
constexpr uint32_t kReferenceBlock = 16;
bool is_reference_block(uint32_t column, uint32_t row, double share);

// $KILN_CACHE/references or its like (unwrap_cache.h); empty: there is no such place.
std::filesystem::path default_reference_folder();

// The kept reference, or a new one, which is then kept. Fails (kInvalidInput) on one that has been damaged,
// naming the file and what to do.
Expected<Reference> obtain_reference(const ReferenceRequest& request,
                                     const std::function<void(const BakeProgress&)>& progress);

}  // namespace kiln
