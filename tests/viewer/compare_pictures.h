// Pictures of other programs against the renderer of preview.png.
#pragma once

#include "coordinator/picture/raster.h"
#include "tests/viewer/published.h"

namespace kiln::test {

constexpr uint32_t kWidth = 480, kHeight = 270;
constexpr uint32_t kSampledWidth = kWidth * kSupersample, kSampledHeight = kHeight * kSupersample;

struct Reference {
  Picture picture;
  std::vector<bool> surface;  // by pixel: shows one alone, not the sky, which no file has, nor a silhouette
};

// The published light from the scene's first camera, exposed and, if asked for, with the filmic curve.
Reference render_reference(const Published& p, float exposure, bool filmic);

struct Difference {
  size_t pixels = 0;
  double mean = 0, median = 0;  // of 255: of the three channels' mean
};

// Over pixels inside surfaces.
Difference compare_pictures(const Reference& ours, const Picture& theirs);

// A picture of kSampledWidth x kSampledHeight, averaged down as the reference is, also on the disk. A test
// failure and an empty picture if the file is none.
Picture read_sampled(const std::filesystem::path& file);

}  // namespace kiln::test
