// ROOM: add an output. One pair of files and one line in the roster.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/base/hash.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/display/display.h"
#include "coordinator/document/gltf_document.h"
#include "coordinator/lightmap/lightmap.h"
#include "coordinator/lightmap/texture_list.h"

namespace kiln {

struct OutputContext {
  const BakeSettings& settings;
  const Scene& scene;
  const Atlas& atlas;
  const GltfDocument& document;
  const Lightmap& lightmap;
  std::filesystem::path folder;
  const Display* display = nullptr;                         // null: what is drawn is the scene
  const Projection* projection = nullptr;                   // of `display`
  const TextureList* textures = nullptr;                    // published beside; null: none
  const std::vector<std::string>* texture_files = nullptr;  // their files, and others of the same stage
};

struct OutputFile {
  std::string name;
  uint64_t bytes = 0;
  Digest digest;
  bool master = false;  // its digest must be equal for equal inputs, seed and numeric class
};

struct Output {
  std::string_view name;
  std::string_view about;
  bool master;
  // Writes its files into the folder and returns their names.
  Expected<std::vector<std::string>> (*write)(const OutputContext&);
};

std::span<const Output> output_roster();

// Writes every output of the roster; digests are those of the files.
Expected<std::vector<OutputFile>> write_outputs(const OutputContext& context);

// "irradiance.exr", or "irradiance.2.exr" for page 2 of several.
std::string page_name(const std::string& stem, const std::string& extension, uint32_t page, uint32_t pages);

Expected<std::vector<std::string>> write_irradiance(const OutputContext& context);
Expected<std::vector<std::string>> write_basis(const OutputContext& context);
Expected<std::vector<std::string>> write_error(const OutputContext& context);
Expected<std::vector<std::string>> write_samples(const OutputContext& context);
Expected<std::vector<std::string>> write_validity(const OutputContext& context);
Expected<std::vector<std::string>> list_textures(const OutputContext& context);
Expected<std::vector<std::string>> write_gltf(const OutputContext& context);
Expected<std::vector<std::string>> write_gltf_instanced(const OutputContext& context);
Expected<std::vector<std::string>> write_charts(const OutputContext& context);

}  // namespace kiln
