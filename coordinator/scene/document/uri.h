// Resolves a URI of a glTF file: the bytes of a data: URI, or a file beside the glTF.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// The file that a relative URI names, relative to `folder`. Percent-coded bytes are decoded. Schemes,
// absolute paths and paths that leave the folder are refused: a scene sent to a farm must not read the
// farm's other files.
Expected<std::filesystem::path> resolve_uri(const std::filesystem::path& folder, const std::string& uri);

// The bytes behind a data: or relative URI. Messages describe the problem; the caller adds which URI it was.
Expected<Bytes> read_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace kiln
