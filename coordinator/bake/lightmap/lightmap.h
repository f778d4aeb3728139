// A lightmap in progress: resolved by merge, completed by the post stages, written by encoders, shown in
// reports.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/responses/basis.h"

namespace kiln {

// Classes of the validity map (validity.exr holds the number).
enum class Validity : uint8_t {
  kEmpty = 0,     // no surface and no neighbour within the dilation; or on a chart without any value
  kMeasured = 1,  // sampled
  kPushed = 2,    // sampled from a point moved out of geometry
  kFilled = 3,    // interpolated from measured texels of the same chart, or across a seam
  kDilated = 4,   // copied from neighbours on any chart
  kInside = 5,    // sampled, hit mostly back faces, and has no neighbour to be filled from
};
constexpr int kValidityClasses = 6;

inline bool is_set(Validity v) {
  return v == Validity::kMeasured || v == Validity::kPushed || v == Validity::kFilled ||
         v == Validity::kDilated;
}

// Planes of one colour of a directional basis: since light is not negative, a direction is at most as long as
// its light. Blending texels preserves that; stages that change planes independently must restore it.
struct DirectionBound {
  size_t light = 0;  // indices into Lightmap::planes
  size_t direction[3] = {};
};

// Of every colour of a basis that has a direction; its planes follow E's.
inline std::vector<DirectionBound> direction_bounds(const BasisInfo& basis) {
  std::vector<DirectionBound> bounds;
  for (size_t c = 0; basis.has_direction && c < 3; ++c) bounds.push_back({3 + c, {6 + c, 9 + c, 12 + c}});
  return bounds;
}

struct Lightmap {
  uint32_t page_height = 0;  // pages are stacked: planes.height = page_height * pages
  bool has_light = true;     // false: planes are samples alone
  Planes planes;             // E.R E.G E.B, the basis' planes, direct.R .G .B if apart, error, samples
  std::vector<Validity> validity;
  std::vector<DirectionBound> bounds;  // by colour; empty without directions
  // E, the basis and the error before filtering, where `planes` is filtered. Empty: the same as `planes`.
  Planes measured;
  // Standard error of the basis by band: planes "L0", "L1"; empty without a basis.
  Planes band_error;
  // What responses store (response_plane()), and the standard error of each by its name.
  Planes responses, response_error;
  // Classes of the responses: as measured, since the denoiser fills texels with light alone.
  std::vector<Validity> response_validity;
};

}  // namespace kiln
