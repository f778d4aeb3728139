// Detects files whose data is compressed in ways that Kiln does not read.
#pragma once

#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// An error that names the extension and the command that writes the file without it; nullopt if the file
// requires none. Call it first, because other data may be unreadable.
Status check_compression(const GltfDocument& document);
// The same where the file merely uses one, to explain files that cannot be read.
Status blame_compression(const GltfDocument& document);

}  // namespace kiln
