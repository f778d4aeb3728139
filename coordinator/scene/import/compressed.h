// Files whose data is compressed in ways that Kiln does not read.
#pragma once

#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// An error that names the extension and the command that writes the file without it; nothing: the file
// requires none of them. Before anything else is read of the file, for there may be nothing to read.
Status check_compression(const GltfDocument& document);
// The same where the file merely uses one: for files that cannot be read otherwise.
Status blame_compression(const GltfDocument& document);

}  // namespace kiln
