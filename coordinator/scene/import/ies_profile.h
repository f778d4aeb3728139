// IES light profiles: the luminous intensity of a lamp by direction, as measured (LM-63).
#pragma once

#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// Type C photometry: vertical angles from the lamp's nadir, horizontal ones around the vertical axis.
struct IesProfile {
  std::vector<double> vertical;    // degrees, ascending, within [0, 180]; dark outside
  std::vector<double> horizontal;  // degrees: {0} if symmetric about the axis, else ascending from 0 to 360
  std::vector<double> candela;     // [h * vertical.size() + v], with all the file's multipliers applied
  bool tilted = false;             // the file has a table for tilted lamps, which is ignored
};

// Reads LM-63 of 1986, 1991, 1995, 2002 and 2019. Adds the planes that the file omits for symmetry. Errors
// (kInvalidInput) name the problem and the number: photometry of type A or B, counts beyond 4,096, angles
// that do not ascend, negative or missing values.
Expected<IesProfile> parse_ies(std::string_view file);

}  // namespace kiln
