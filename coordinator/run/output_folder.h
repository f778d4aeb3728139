// Whether a bake could be published at its end: asked before hours of work, not after.
#pragma once

#include <filesystem>

#include "common/base/status.h"

namespace kiln {

// Fails as prepare_output_folder() would, but leaves nothing behind: folders made on the way are removed.
Status check_output_folder(const std::filesystem::path& folder);

}  // namespace kiln
