// What scene.glb says of probes, by their own file.
#pragma once

#include <filesystem>

#include "common/base/status.h"
#include "coordinator/output/context/published_probes.h"

namespace kiln {

// Of the probes.json in a folder. Fails (kInvalidInput) where it is not what write_probe_files() writes.
Expected<PublishedProbes> read_published_probes(const std::filesystem::path& folder);

}  // namespace kiln
