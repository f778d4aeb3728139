// A glTF file as it stands: its JSON, its buffers and where it came from. Import reads the scene out of
// it; the glTF encoder writes it again with lightmap coordinates, keeping what neither understands.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

struct GltfDocument {
  std::filesystem::path path;   // for messages and relative URIs
  std::string json;             // the JSON text
  std::vector<Bytes> buffers;   // by index of "buffers", each at least byteLength long
};

// Reads .gltf (external and data: buffers) or .glb. Errors (kInvalidInput) name the file and the element:
// truncated or corrupt GLB, missing .bin, wrong lengths, JSON that does not parse.
Expected<GltfDocument> read_gltf_document(const std::filesystem::path& path);

// One binary glTF file of a JSON text and a single buffer.
Bytes write_glb(const std::string& json, const Bytes& buffer);

}  // namespace kiln
