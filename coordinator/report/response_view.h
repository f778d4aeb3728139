// Pictures of a response: the scene coloured by it from the preview's camera, beside the atlas.
#pragma once

#include "common/atlas/atlas.h"
#include "common/responses/response.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/picture/picture.h"
#include "coordinator/picture/raster.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// One stored value is shown in grey, 0 black and 1 white; three as (1 + value) / 2. Surfaces
// without a value are magenta, the background is dark grey.
Picture response_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                         const ResponseInfo& response, const View& view, uint32_t fine);

// A map whose E is grey, the length of that response: for pictures of maps without light.
Lightmap lit_by(const Lightmap& map, const ResponseInfo& response);

}  // namespace kiln
