// Checks an OpenEXR header before the library allocates what it claims.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/status.h"

namespace kiln {

constexpr size_t kMaxExrHeaderBytes = size_t{1} << 20;

// Walks the attributes (OpenEXR file layout, "Header"): every size within the file, and a preview image as
// large as it says. `head`: the first bytes of the file, all or kMaxExrHeaderBytes of them, in which the
// header must end. Fails (kInvalidInput) with a sentence that continues "FILE: ".
Status check_exr_header(std::span<const std::byte> head);

}  // namespace kiln
