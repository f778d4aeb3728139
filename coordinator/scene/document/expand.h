// Compressed data of a glTF, written as plain data: EXT_meshopt_compression (KHR_meshopt_compression where it
// uses the same bitstreams) and KHR_draco_mesh_compression. Whoever reads the document afterwards meets
// neither.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "coordinator/scene/document/budget.h"

namespace kiln {

using GltfBuffers = std::vector<std::shared_ptr<const Bytes>>;

// Names of the extensions that were in use and are no longer. `root` names the new buffers, and what they
// hold is counted before it is unpacked. Errors (kInvalidInput) name the file, the element and what is wrong
// with it.
Expected<std::vector<std::string>> expand_compressed(nlohmann::json& root, GltfBuffers& buffers,
                                                     ImportBudget& budget, const std::filesystem::path& path);

}  // namespace kiln
