// Error of light from decoded textures against the map.
#pragma once

#include <array>
#include <span>

#include "common/math/vec.h"
#include "common/responses/basis.h"
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
  // What an engine shows, at texel centres and between them, where the normal is turned by so many degrees
  // from the surface's (four ways). 0 degrees: against E itself, what the format leaves out included. Others:
  // against the stored basis, since E was measured at the surface's own normal only (docs/bases.md has the
  // errors of the bases there). Relative to E at the own normal, with the floor above; bias: mean of the
  // signed relative error of luminance. Without a basis: 0 degrees alone.
  struct AtNormal {
    double degrees = 0, bias = 0, rms = 0;
  };
  std::array<AtNormal, 4> at_normal{{{0}, {15}, {35}, {60}}};
  // At the surface's own normal against the same basis uncompressed, rms: what another format could better.
  double format = 0;

  double relative_rms() const;
};

constexpr int kErrorNormals = 16;
// Directions over the hemisphere around a unit normal, evenly in solid angle (a spherical Fibonacci set,
// Keinert et al. 2015): the normals that normal maps may use.
void hemisphere_normals(const Vec3& normal, Vec3 out[kErrorNormals]);

// `basis`: of which the textures hold the functions; null: they hold E. `normals`: by texel
// (common/atlas/texel_normals.h); unused without a basis. `exact`: the same textures uncompressed.
// `picture`, if not null, gets the relative rms error of every texel, 0 where unused. Independent of the
// number of threads.
TextureError measure_texture_error(const MapLevel& level, const BasisInfo* basis,
                                   std::span<const Vec3> normals, std::span<const DecodedTexture> textures,
                                   std::span<const DecodedTexture> exact,
                                   std::vector<float>* picture = nullptr, uint32_t every = 1);

}  // namespace kiln
