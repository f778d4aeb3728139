// Lamps in lumens beside emission in watts: what Blender's exporter writes by default.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Blender's exporter multiplies lamps by 683 lm/W ("Lighting Mode: Standard": a sun of W/m2 to lux; a lamp of
// W to W/sr x 683 candela) and leaves emission and environment as they are, so that those all but disappear.
// Warns where lamps look like that and something else shines: of files that Blender wrote by the size of the
// numbers, of others where the numbers are round multiples of the factor.
void warn_of_lumens(const ImportContext& context, const Scene& scene, ImportNotes& notes);

}  // namespace kiln
