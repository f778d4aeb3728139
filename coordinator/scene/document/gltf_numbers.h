// Numbers of a glTF that place data in buffers. The parser of its structure takes a negative one for none.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common/base/status.h"

namespace kiln {

// Fails (kInvalidInput, naming the element) if a byteOffset, byteLength, byteStride or count of a buffer view
// or an accessor, its sparse parts included, is anything but a whole number of at least 0.
Status check_gltf_numbers(const nlohmann::json& root, const std::filesystem::path& path);

}  // namespace kiln
