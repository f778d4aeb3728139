// Flattens one chart into the plane and proves that the result is usable.
#pragma once

#include <optional>
#include <vector>

#include "common/raster/triangle2.h"
#include "common/unwrap/surface.h"

namespace kiln {

// Stretch of the map from the plane to the surface. Sander, Snyder, Gortler, Hoppe 2001, "Texture Mapping
// Progressive Meshes", section 3: L2 of a face is the root mean square of its singular values, Linf the
// larger one; of a chart the area-weighted root mean square and the largest. 1: isometric. Linf = 2:
// somewhere texels are twice as far apart as requested.
struct Stretch {
  double l2 = 1, linf = 1;
};

struct FlatChart {
  std::vector<uint32_t> faces;  // rising
  std::vector<Triangle2> flat;  // by entry of `faces`: metres, floats, the box begins at (0, 0)
  Stretch stretch;
  double area = 0;  // of the surface, m^2
};

struct FlattenLimits {
  double l2 = 1.1;
  double linf = 2;
};

// Per-mesh state of flattening. Charts own their faces, so several threads may work on different charts at
// once.
struct ChartState {
  explicit ChartState(const Surface& surface)
      : glued(3 * surface.face_count(), 0), slot(surface.face_count(), 0) {}
  std::vector<uint8_t> glued;  // by side: joined with its opposite inside one chart
  std::vector<uint32_t> slot;  // by face: its index within its chart
};

// Lays faces (rising, none degenerate, glued as `state` says) into the plane: along their mean normal where
// that stretches little, else by LSCM, else along the normal within the limits, else as rigid as possible.
// nullopt if a face would be flipped, overlap another, or be stretched beyond the limits. `work` is increased
// by the cost, in faces.
std::optional<FlatChart> flatten(const Surface& surface, ChartState& state, std::vector<uint32_t> faces,
                                 const FlattenLimits& limits, uint64_t& work);

// The same along `axis` only, without the overlap test: the caller guarantees that faces do not overlap.
FlatChart flatten_single(const Surface& surface, uint32_t face);

Stretch measure_stretch(const Surface& surface, const std::vector<uint32_t>& faces,
                        const std::vector<Triangle2>& flat);

// Rotated to the smallest box with a side along the hull, scaled to the surface's area, moved to (0, 0) and
// rounded to floats.
void settle(std::vector<Triangle2>& flat, double area);

}  // namespace kiln
