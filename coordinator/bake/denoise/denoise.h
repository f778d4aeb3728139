// The lightmap denoiser: texels are mixed with those around them on the surface, each as far as the two
// replicates show that this lowers its error. docs/denoising.md has the method, its sources and figures.
#pragma once

#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

struct Denoised {
  // [site][plane], from both replicates; sites that are not known have the mean of both.
  ZeroedVector<float> mean;
  std::vector<float> luminance;  // [site] of E, filtered
  // [site] of the luminance of E: root of the estimated mean squared error, bias included; of the mean of
  // both replicates as measured, from the replicates' differences around the site. 0 where nothing is known;
  // infinite where what was measured is no number.
  std::vector<float> standard_error, raw_error;
  std::vector<float> strength;  // [site] 0: as measured; towards 1: the more other texels take part
  std::vector<uint8_t>
      filled;  // [site] 1: has no samples, and takes what those around it on the surface have
};

// All planes get the same weights. Sites without samples take the mean of the filtered sites around them, and
// the larger of their errors and of their spread. `bounds` (indices of planes; lights of them and E, planes 0
// to 2, are never negative) holds directions to the length of their light. The same bits for any number of
// threads. Of the order of 10 microseconds a site on one core with 15 planes, and 190 bytes beside the
// result.
Denoised denoise(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                 const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads);

// The same without `mean`: what the error is. Somewhat less a site.
Denoised denoise_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                           const SurfaceLinks& links, unsigned threads);

}  // namespace kiln
