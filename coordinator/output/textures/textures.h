// Textures for engines: lays out planes of the map, compresses them, measures the decoded error and writes
// files.
#pragma once

#include <filesystem>
#include <optional>

#include "common/job/settings.h"
#include "coordinator/bake/lightmap/texture_list.h"
#include "coordinator/output/textures/seam_match.h"
#include "coordinator/output/textures/texture_error.h"

namespace kiln {

struct EncodeTextures {
  const Scene& scene;
  const Atlas& atlas;
  const Lightmap& lightmap;
  const BakeSettings& settings;
  std::filesystem::path folder;
  uint32_t measure_every = 1;   // measures the error of one in this many rows of blocks
  SeamFinder* seams = nullptr;  // seams of this atlas; null: found where needed
};

// Results of one --encode name for one quantity.
struct TextureFigures {
  std::string encoding, quantity;  // "bc6h", "sh_l1" or "irradiance"
  bool is_light = true;            // false: a response, whose errors are absolute
  std::string effort;              // the effort used; empty: the format has none
  double seconds = 0;              // wall time of compression
  uint64_t texels = 0;             // of level 0, times textures
  double bits = 0;                 // per texel of the atlas, all textures together, level 0
  uint64_t bytes = 0;              // of its files
  uint64_t clamped = 0;            // values outside the format's range
  TextureError error;
  std::optional<SeamMatch> seams;  // of the texture with the largest steps before
  bool within_bound = true;        // of --max-encode-error; auto: always
  // With --max-encode-error auto: the bound and the error held against it, both relative rms; 0: no bound.
  double bound = 0, held = 0;
  std::string instead_of;  // the default encoding, where another had to take its place; empty: as asked for
  double held_of_it = 0;   // its error
};

struct TextureResult {
  TextureList list;
  std::vector<TextureFigures> figures;
  std::vector<std::string> files;                  // written into the folder, in order
  std::vector<std::vector<float>> error_pictures;  // by figures: relative rms error of every texel
};

// Estimates for `kiln plan`: bytes of files before supercompression, and peak memory in addition to the map.
struct TextureNeeds {
  uint64_t disk = 0, memory = 0;
};
TextureNeeds texture_needs(const BakeSettings& settings, uint64_t texels);
// Fails (kUsage) on an encoding that cannot hold the basis; names the way out.
Status check_encodings(const BakeSettings& settings);

// Also writes encode_error_NAME.exr: the relative rms error of every texel after decoding.
// Errors: kInvalidInput for values that cannot be stored; kIo, kNoSpace from writing. Textures beyond
// --max-encode-error at the best effort are not written, which their figures record.
Expected<TextureResult> make_textures(const EncodeTextures& request);

// One sentence about the textures beyond the bound; empty: none.
std::string beyond_bound(const TextureResult& result, const BakeSettings& settings);
// Warnings about published textures beyond the bound of `auto`, with what to do.
std::vector<std::string> coarse_textures(const TextureResult& result);

}  // namespace kiln
