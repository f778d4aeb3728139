// Textures in the report: size, error and speed of each encoding.
#pragma once

#include <span>

#include "common/base/json.h"
#include "coordinator/output/textures/textures.h"

namespace kiln {

// "textures": [...]
void write_textures(JsonWriter& w, std::span<const TextureFigures> figures);
// An HTML table; empty without textures.
std::string textures_table_html(std::span<const TextureFigures> figures);
// Lines for a terminal: size and error of each encoding.
std::string textures_summary(std::span<const TextureFigures> figures);

}  // namespace kiln
