// Textures for engines: planes of the map laid out, compressed, measured after decoding, and written as
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
  uint32_t measure_every = 1;   // of so many rows of blocks the error of one is measured
  SeamFinder* seams = nullptr;  // of these; null: looked for where they are needed
};

// What one --encode name came to for one quantity.
struct TextureFigures {
  std::string encoding, quantity;  // "bc6h", "sh_l1" or "irradiance"
  bool is_light = true;            // false: of a response, and errors are absolute
  std::string effort;              // that was used; empty: the format knows none
  double seconds = 0;              // of compression, on the clock
  uint64_t texels = 0;             // of level 0, times textures
  double bits = 0;                 // a texel of the atlas, all textures together, level 0
  uint64_t bytes = 0;              // of its files
  uint64_t clamped = 0;            // values beyond what the format holds
  TextureError error;
  std::optional<SeamMatch> seams;  // of the texture with most steps before
  bool within_bound = true;        // of --max-encode-error
};

struct TextureResult {
  TextureList list;
  std::vector<TextureFigures> figures;
  std::vector<std::string> files;                  // written into the folder, in order
  std::vector<std::vector<float>> error_pictures;  // by figures: relative rms error of every texel
};

// Estimates for `kiln plan`: bytes of files before supercompression, and memory on top of the map while they
// are made.
struct TextureNeeds {
  uint64_t disk = 0, memory = 0;
};
TextureNeeds texture_needs(const BakeSettings& settings, uint64_t texels);

// Besides textures, encode_error_NAME.exr: the relative rms error of every texel after decoding.
// Errors: kInvalidInput for what cannot be stored; kIo, kNoSpace from writing. Textures beyond
// --max-encode-error at the best effort are not written; their figures say so.
Expected<TextureResult> make_textures(const EncodeTextures& request);

// One sentence about the textures that are beyond the bound; empty: none.
std::string beyond_bound(const TextureResult& result, const BakeSettings& settings);

}  // namespace kiln
