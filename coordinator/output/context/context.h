// The input of every output of a bake, and the names of the files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/lightmap/texture_list.h"
#include "coordinator/scene/display/display.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

struct OutputContext {
  const BakeSettings& settings;
  const Scene& scene;
  const Atlas& atlas;
  const GltfDocument& document;
  const Lightmap& lightmap;
  std::filesystem::path folder;
  const Display* display = nullptr;                         // null: the scene itself is drawn
  const Projection* projection = nullptr;                   // projection of `display`
  const TextureList* textures = nullptr;                    // published textures; null: none
  const std::vector<std::string>* texture_files = nullptr;  // theirs, and others of the same stage
  bool compress = true;                                     // masters: smaller files, slower to write
};

// "irradiance.exr", or "irradiance.2.exr" for page 2 of several.
std::string page_name(const std::string& stem, const std::string& extension, uint32_t page, uint32_t pages);

}  // namespace kiln
