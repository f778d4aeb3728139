// Detects files whose data is compressed in ways that Kiln does not read.
#pragma once

#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// An error that names the extension and the command that writes the file without it, if the file requires
// one. Call it first, because other data may be unreadable.
Status check_compression(const GltfDocument& document);

}  // namespace kiln
