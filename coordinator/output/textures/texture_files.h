// Writes finished textures and lists the published files.
#pragma once

#include <filesystem>

#include "common/job/settings.h"
#include "coordinator/bake/lightmap/texture_list.h"
#include "coordinator/output/container/container.h"
#include "coordinator/output/textures/texture_values.h"

namespace kiln {

// One texture with its texels: levels[k][page] are bytes of the format. `values`: level 0 before compression.
struct FinishedTexture {
  TextureLayout layout;
  TextureScale scale;
  uint32_t width = 0, height = 0, pages = 1;
  std::vector<std::vector<Bytes>> levels;
  std::vector<float> values;
};

struct WrittenFiles {
  TextureList list;  // one entry per container
  std::vector<std::string> names;
};

// Adds encodings to those that are published; textures of one encoding and container join.
void add_published(TextureList added, TextureList& list);

// Writes the textures of one encoding by rename.
Expected<WrittenFiles> write_texture_files(const Encoding& encoding,
                                           std::span<const FinishedTexture> textures,
                                           const BakeSettings& settings, const std::filesystem::path& folder);

}  // namespace kiln
