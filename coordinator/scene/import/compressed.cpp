#include "coordinator/scene/import/compressed.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {
namespace {

struct Compression {
  const char* extension;
  const char* what;
  const char* command;  // the glTF Transform command that removes it
};
constexpr Compression kCompressions[] = {
    // Debian 12 has no decoder.
    {"KHR_texture_basisu", "its textures are compressed with Basis Universal", "ktxdecompress"},
};

}  // namespace

Status check_compression(const GltfDocument& document) {
  const auto& required = document.extensions_required;
  for (const Compression& c : kCompressions)
    if (std::find(required.begin(), required.end(), c.extension) != required.end())
      return fail(
          ErrorKind::kInvalidInput,
          text("{}: it requires {}: {}, which Kiln does not read. `npx @gltf-transform/cli {} {} out.glb` "
               "writes it without",
               document.path.string(), c.extension, c.what, c.command, document.path.filename().string()));
  return {};
}

}  // namespace kiln
