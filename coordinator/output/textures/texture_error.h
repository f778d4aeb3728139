// Error of light from decoded textures against the map.
#pragma once

#include <span>

#include "common/math/vec.h"
#include "coordinator/output/textures/texture_values.h"

namespace kiln {

// All errors are of E(n) over three channels, relative to the texel's mean luminance of E over its normals
// (with the floor of `kiln compare`: a hundredth of the map's mean). With a directional basis: over 16
// normals of the hemisphere around the surface's; else of E only. Sample points: the texel centres of charts,
// and the centres of 2x2 texels of one chart, where filtering ratios and their base separately is worst.
struct TextureError {
  uint64_t texels = 0, between = 0;  // sample points of both kinds
  double rel_mse = 0;                // all points
  double rel_mse_texels = 0, rel_mse_between = 0;
  double rel_mse_filter = 0;  // between texels, for uncompressed values filtered in the same way
  double psnr_log = 0;        // dB: range of log2 of the luminance of E(n) + mean / 1024 over its rms error
  struct Place {
    uint32_t page = 0, x = 0, y = 0;
    double error = 0;
  };
  Place worst_block;  // rms relative error over the texels of a 4x4 block; x, y: its first texel
  Place worst_texel;  // rms relative error over the normals

  double relative_rms() const;
};

// `normals`: by texel (texel_normals.h); unused without directions. `exact`: the same textures uncompressed.
// `picture`, if not null, gets the relative rms error of every texel, 0 where unused. Independent of the
// number of threads.
TextureError measure_texture_error(const MapLevel& level, std::span<const Vec3> normals,
                                   std::span<const DecodedTexture> textures,
                                   std::span<const DecodedTexture> exact,
                                   std::vector<float>* picture = nullptr, uint32_t every = 1);

}  // namespace kiln
