// Detects lamps in lumens next to emission in watts, which Blender's exporter writes by default.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Blender's exporter multiplies lamps by 683 lm/W ("Lighting Mode: Standard": a sun of W/m2 to lux; a lamp of
// W to W/sr x 683 candela) and leaves emission and environment unscaled, so that those all but disappear.
// Warns if lamps look scaled and something else emits: judged by magnitude in files written by Blender, and
// by round multiples of the factor in others.
void warn_of_lumens(const ImportContext& context, const Scene& scene, ImportNotes& notes);

}  // namespace kiln
