// What a URI of a glTF file stands for: a data: URI's own bytes, or a file beside the glTF.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// The file that a relative URI names, seen from `folder`. Percent-coded bytes are decoded. Schemes,
// absolute paths and paths that leave the folder are refused: a scene sent to a farm must not read the
// farm's other files.
Expected<std::filesystem::path> resolve_uri(const std::filesystem::path& folder, const std::string& uri);

// The bytes behind a data: or relative URI. Messages say what is wrong, not whose URI it is.
Expected<Bytes> read_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace kiln
