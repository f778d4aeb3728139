// The binary container of glTF 2.0 (specification, chapter 4): header, JSON chunk, optional BIN chunk.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

struct GlbParts {
  std::string_view json;                             // views into the given file
  std::optional<std::span<const std::byte>> binary;  // the BIN chunk with its padding
};

bool is_glb(std::span<const std::byte> file);

// Splits a GLB without copying. `name` heads the error messages.
Expected<GlbParts> read_glb(std::span<const std::byte> file, const std::string& name);

}  // namespace kiln
