#include "coordinator/scene/import/compressed.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {
namespace {

struct Compression {
  const char* extension;
  const char* what;
  const char* command;  // the glTF Transform command that removes it
  const char* besides;
};
constexpr Compression kCompressions[] = {
    {"KHR_draco_mesh_compression", "its meshes are compressed with Draco", "copy",
     " (Blender's exporter writes none with Data > Compression off)"},
    {"EXT_meshopt_compression", "its data is compressed with meshopt", "copy", ""},
    {"KHR_meshopt_compression", "its data is compressed with meshopt", "copy", ""},
    {"KHR_texture_basisu", "its textures are compressed with Basis Universal", "ktxdecompress", ""},
};

Status refuse(const GltfDocument& document, const std::vector<std::string>& extensions) {
  for (const Compression& c : kCompressions)
    if (std::find(extensions.begin(), extensions.end(), c.extension) != extensions.end())
      return fail(
          ErrorKind::kInvalidInput,
          text("{}: it requires {}: {}, which Kiln does not read. `npx @gltf-transform/cli {} {} out.glb` "
               "writes it without{}",
               document.path.string(), c.extension, c.what, c.command, document.path.filename().string(),
               c.besides));
  return {};
}

}  // namespace

Status check_compression(const GltfDocument& document) {
  return refuse(document, document.extensions_required);
}

Status blame_compression(const GltfDocument& document) {
  return refuse(document, document.extensions_used);
}

}  // namespace kiln
