// A lightmap under way: what merge resolves, post stages complete, encoders write and reports show.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/responses/basis.h"

namespace kiln {

// Classes of the validity map (validity.exr holds the number).
enum class Validity : uint8_t {
  kEmpty = 0,     // no surface, no neighbour within the dilation; or of a chart of which nothing is known
  kMeasured = 1,  // sampled
  kPushed = 2,    // sampled from a place moved out of geometry
  kFilled = 3,    // from measured texels of the same chart
  kDilated = 4,   // from neighbours of any chart
  kInside = 5,    // sampled, saw mostly back faces, and had no neighbour to be filled from
};
constexpr int kValidityClasses = 6;

inline bool is_set(Validity v) {
  return v == Validity::kMeasured || v == Validity::kPushed || v == Validity::kFilled ||
         v == Validity::kDilated;
}

// Planes of one colour of a directional basis: the length of a direction is at most the light, since no light
// is negative. Mixing texels keeps that; what moves planes apart from each other must see to it.
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
  Planes planes;             // E.R E.G E.B, the basis' planes, error, samples
  std::vector<Validity> validity;
  std::vector<DirectionBound> bounds;  // by colour; empty without directions
  // What was measured, where the planes above hold what was filtered: E and the basis, and its own error.
  // Empty: as above.
  Planes measured;
  // Standard error of the basis by band: planes "L0", "L1"; empty without a basis.
  Planes band_error;
  // What responses store (response_plane()), and the standard error of each by its name.
  Planes responses, response_error;

  // Calls visit(values of a plane) for all that is published and completed between texels: light and
  // responses.
  template <class Visit>
  void for_each_plane(const Visit& visit) {
    for (std::vector<float>& plane : planes.data) visit(plane);
    for (std::vector<float>& plane : responses.data) visit(plane);
    for (std::vector<float>& plane : response_error.data) visit(plane);
  }
};

}  // namespace kiln
