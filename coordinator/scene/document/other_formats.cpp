#include "coordinator/scene/document/other_formats.h"

#include <algorithm>
#include <string_view>

#include "common/base/format.h"

namespace kiln {
namespace {

struct OtherFormat {
  const char* extension;
  const char* magic;  // at the beginning; empty: the extension decides
  const char* name;
  const char* menu;  // of Blender
};

constexpr const char* kOpen = "File > Open";
// Binary formats first: what a file begins with says more than what it is called.
constexpr OtherFormat kFormats[] = {
    {".blend", "BLENDER", "a Blender file", kOpen},
    {".fbx", "Kaydara FBX Binary", "FBX", "File > Import > FBX"},
    {".usdc", "PXR-USDC", "OpenUSD", "File > Import > Universal Scene Description"},
    {".usda", "#usda", "OpenUSD", "File > Import > Universal Scene Description"},
    {".usdz", "", "OpenUSD", "File > Import > Universal Scene Description"},
    {".usd", "", "OpenUSD", "File > Import > Universal Scene Description"},
    {".obj", "", "Wavefront OBJ", "File > Import > Wavefront"},
    {".fbx", "", "FBX", "File > Import > FBX"},
    {".blend", "", "a Blender file", kOpen},
    {".dae", "", "COLLADA", "File > Import > Collada"},
    {".ply", "", "PLY", "File > Import > Stanford"},
    {".stl", "", "STL", "File > Import > STL"},
    {".abc", "", "Alembic", "File > Import > Alembic"},
};

}  // namespace

std::string name_other_format(const std::filesystem::path& path, std::span<const std::byte> file) {
  const std::string_view head(reinterpret_cast<const char*>(file.data()), std::min<size_t>(file.size(), 32));
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const OtherFormat& format : kFormats) {
    const std::string_view magic = format.magic;
    if (magic.empty() ? extension != format.extension : !head.starts_with(magic)) continue;
    return text(
        "it is {}, and Kiln reads glTF 2.0 (.gltf, .glb): in Blender, {}, then File > Export > glTF 2.0 with "
        "Data > Lighting > Lighting Mode: Unitless writes one",
        format.name, format.menu);
  }
  return "it is neither a GLB, which begins with \"glTF\", nor the JSON of a .gltf, which begins with a "
         "brace: name "
         "the scene's .gltf or .glb file";
}

}  // namespace kiln
