// Writes finished textures and lists the published files.
#pragma once

#include <filesystem>
#include <map>

#include "common/base/hash.h"
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

// A folder and what was written into it. A texture is called lightmap_FORMAT_PLANE.EXT, by the format that
// its own file holds. Encodings that store a plane in one format share its file. Where their bytes differ
// (one encoding took a higher effort), the later file has its encoding's name as well.
class TextureFolder {
 public:
  explicit TextureFolder(std::filesystem::path path) : path_(std::move(path)) {}
  const std::filesystem::path& path() const { return path_; }
  // Writes by rename, unless the same is there. `name` without extension. Returns the name of the file.
  Expected<std::string> write(const std::string& name, const std::string& encoding,
                              std::string_view extension, std::span<const std::byte> bytes);

 private:
  std::filesystem::path path_;
  std::map<std::string, Digest> written_;
};

// Adds encodings to those that are published; textures of one encoding and container join.
void add_published(TextureList added, TextureList& list);

// Writes the textures of one encoding by rename.
Expected<WrittenFiles> write_texture_files(const Encoding& encoding,
                                           std::span<const FinishedTexture> textures,
                                           const BakeSettings& settings, TextureFolder& folder);

}  // namespace kiln
