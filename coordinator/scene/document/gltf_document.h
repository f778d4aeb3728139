// A glTF file as read: its JSON, its buffers and its path. Import reads the scene from it; the glTF encoder
// writes it again with lightmap coordinates and keeps everything that neither understands.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "coordinator/scene/document/budget.h"

namespace kiln {

// The location of an image in "images"; exactly one of uri and buffer_view is set in a valid file.
struct GltfImage {
  std::string name;
  std::string uri;
  int64_t buffer_view = -1;
};

struct GltfDocument {
  std::filesystem::path path;  // for messages and relative URIs
  std::string json;            // the JSON text, of plain data alone (expand.h)
  std::string structure;       // the same without "buffers" and "images", so that parsing it loads no files
  std::vector<std::string> extensions_used, extensions_required;
  std::vector<std::string> expanded;  // extensions of compressed data that were in use
  std::vector<std::string> variants;  // names of KHR_materials_variants
  std::vector<GltfImage> images;
  // By index of "buffers", each at least byteLength long; those that name one file share its bytes. Empty: a
  // fallback buffer of EXT_meshopt_compression, which has no data by design. Data that was compressed
  // follows.
  std::vector<std::shared_ptr<const Bytes>> buffers;
  std::shared_ptr<ImportBudget> budget;  // what the import of this file may still take; never null once read
};

// Reads .gltf (external and data: buffers) or .glb. Errors (kInvalidInput) name the file and the element:
// truncated or corrupt GLB, missing .bin, wrong lengths, JSON that does not parse, more than its budget
// allows, no such variant. `variant`: materials have those of this variant of KHR_materials_variants; empty:
// their own.
Expected<GltfDocument> read_gltf_document(const std::filesystem::path& path, const std::string& variant = "");

// One binary glTF file of a JSON text and a single buffer.
Bytes write_glb(const std::string& json, const Bytes& buffer);

}  // namespace kiln
