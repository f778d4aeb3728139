// Textures used by materials: collected first, then decoded once each, in parallel.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/scene/import/context.h"

namespace kiln {

// The use of a texture determines its encoding, channels and size.
struct TextureRequest {
  int texture = -1;  // index in the glTF
  // sRGB colours; linear factors in R, G and B; a linear factor in A alone; a normal map.
  enum class Role { kColor, kFactors, kAlpha, kNormal } role = Role::kColor;
  bool keep_alpha = false;
  auto operator<=>(const TextureRequest&) const = default;
};

class TextureSet {
 public:
  // A slot for the request; equal requests share one.
  int32_t add(const TextureRequest& request);
  // Decodes all slots. A texture that is missing or broken is a warning and gets no index. Error: all of them
  // together are more than the import's budget.
  Expected<std::vector<Texture>> decode(const ImportContext& context, ImportNotes& notes);
  // After decode: the index into its result, or -1.
  int32_t index_of(int32_t slot) const { return index_[static_cast<size_t>(slot)]; }

 private:
  std::vector<TextureRequest> requests_;
  std::map<TextureRequest, int32_t> slots_;
  std::vector<int32_t> index_;
};

// The file's encoded image by index.
Expected<Bytes> read_image_bytes(const ImportContext& context, int image);
// "image 3 'bark'"
std::string image_name(const ImportContext& context, int image);

}  // namespace kiln
