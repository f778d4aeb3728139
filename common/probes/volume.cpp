#include "common/probes/volume.h"

#include <cmath>

#include "common/base/format.h"

namespace kiln {

std::string fault_of(const ProbeBox& box) {
  constexpr double kFar = 1e7;  // metres; floats have steps of a metre there
  for (int k = 0; k < 3; ++k) {
    const char axis = "xyz"[k];
    if (!(std::abs(box.low[k]) <= kFar && std::abs(box.high[k]) <= kFar))
      return text("probe volume '{}': its box ends farther than {:g} m from the origin along {}", box.name,
                  kFar, axis);
    if (!(box.low[k] < box.high[k]))
      return text("probe volume '{}': its box has no volume: along {} it goes from {:g} to {:g}", box.name,
                  axis, box.low[k], box.high[k]);
  }
  if (!(box.spacing >= 1e-3 && box.spacing <= 1e6))
    return text("probe volume '{}': its spacing is {:g}; it may be 0.001 to 1000000 m", box.name,
                box.spacing);
  if (!(box.max_spacing >= box.spacing && box.max_spacing <= 1e6))
    return text("probe volume '{}': its largest spacing is {:g} m; it may be its spacing, {:g} m, or more",
                box.name, box.max_spacing, box.spacing);
  return "";
}

}  // namespace kiln
