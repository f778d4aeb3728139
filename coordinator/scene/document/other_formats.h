// What a file is that is no glTF, and how its scene becomes one.
#pragma once

#include <filesystem>
#include <span>
#include <string>

namespace kiln {

// A clause for a file that is neither a GLB nor JSON text: "it is Wavefront OBJ, and Kiln reads glTF 2.0
// ...", with the program and menu that write glTF of it.
std::string name_other_format(const std::filesystem::path& path, std::span<const std::byte> file);

}  // namespace kiln
