#include "coordinator/scene/import/textures.h"

#include <algorithm>
#include <cstring>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/scene/document/uri.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/scene/import/accessors.h"

namespace kiln {
namespace {

// Diffuse transport averages over metres, so finer texels only cost memory; an alpha mask cuts visible shadow
// shapes, so it keeps more.
constexpr uint32_t kMaxSide = 1024, kMaxMaskSide = 2048;
constexpr uint64_t kDecodedAtOnce = uint64_t{512} << 20;  // bytes, by all threads

// The alpha channel, or 1 if there is none.
Texture only_alpha(const Texture& in) {
  Texture out = in;
  out.channels = 1;
  const size_t bytes = out.texel_bytes(), count = size_t{in.width} * in.height;
  out.texels.assign(count * bytes, std::byte{255});
  const float one = 1.0f;
  for (size_t i = 0; i < count; ++i)
    if (in.channels == 2 || in.channels == 4)
      std::memcpy(&out.texels[i * bytes], &in.texels[(i * in.channels + in.channels - 1) * bytes], bytes);
    else if (bytes == sizeof one)
      std::memcpy(&out.texels[i * bytes], &one, bytes);
  return out;
}

// Keeps the first `channels` channels; grey is replicated when there are too few.
Texture with_channels(Texture in, uint32_t channels) {
  if (in.channels == channels) return in;
  Texture out = in;
  out.channels = channels;
  const size_t count = size_t{in.width} * in.height;
  out.texels.resize(count * channels);
  for (size_t i = 0; i < count; ++i)
    for (uint32_t c = 0; c < channels; ++c)
      out.texels[i * channels + c] = in.texels[i * in.channels + (in.channels <= 2 ? 0 : c)];
  return out;
}

uint32_t channels_of(const TextureRequest& request, const Texture& decoded) {
  using Role = TextureRequest::Role;
  if (request.role == Role::kFactors || request.role == Role::kNormal) return 3;
  if (request.keep_alpha) return decoded.channels;
  return decoded.channels <= 2 ? 1 : 3;
}

Wrap wrap_of(int word) {
  return word == 33071 ? Wrap::kClamp : word == 33648 ? Wrap::kMirror : Wrap::kRepeat;
}

int source_of(const GltfTexture& texture) {
  for (const char* name : {"EXT_texture_avif", "EXT_texture_webp"}) {
    const auto found = texture.extensions.find(name);
    const int other = found == texture.extensions.end() ? -1 : found->second.index("source");
    if (other >= 0) return other;
  }
  return texture.source;
}

Status take_textures(const ImportContext& context, uint64_t bytes) {
  return context.document.budget->take(bytes, "the textures of its materials");
}

struct Decoded {
  Texture texture;
  bool reduced = false;
};

Expected<Decoded> decode_one(const ImportContext& context, const TextureRequest& request, MemoryGate& gate) {
  const GltfModel& model = context.model;
  if (request.texture < 0 || static_cast<size_t>(request.texture) >= model.textures.size())
    return context.bad(
        text("texture {} does not exist, there are {}", request.texture, model.textures.size()));
  const GltfTexture& file_texture = model.textures[static_cast<size_t>(request.texture)];
  const int source = source_of(file_texture);
  if (source < 0)
    return context.bad(text("{} has no image in a format that is supported",
                            element("texture", static_cast<size_t>(request.texture), file_texture.name)));
  KILN_TRY(const Bytes bytes, read_image_bytes(context, source));
  MemoryGate::Hold hold(gate);
  KILN_TRY(Texture texture,
           decode_image(bytes, text("{}: {}", context.document.path.string(), image_name(context, source)),
                        &hold));
  const auto& image = context.document.images[static_cast<size_t>(source)];
  texture.name = !image.name.empty() ? image.name : text("image {}", source);
  if (file_texture.sampler >= 0 && static_cast<size_t>(file_texture.sampler) < model.samplers.size()) {
    const GltfSampler& sampler = model.samplers[static_cast<size_t>(file_texture.sampler)];
    texture.wrap_s = wrap_of(sampler.wrap_s);
    texture.wrap_t = wrap_of(sampler.wrap_t);
    texture.nearest = sampler.mag_filter == 9728;
  }
  if (request.role == TextureRequest::Role::kColor) texture.format = TexelFormat::kSrgb8;
  const uint32_t limit = request.keep_alpha ? kMaxMaskSide : kMaxSide;
  const bool reduced = std::max(texture.width, texture.height) > limit;
  if (request.role == TextureRequest::Role::kAlpha) texture = only_alpha(texture);
  const uint32_t channels = channels_of(request, texture);
  Decoded out{reduce_texture(with_channels(std::move(texture), channels), limit), reduced};
  KILN_TRY_STATUS(take_textures(context, out.texture.texels.size()));
  return out;
}

}  // namespace

std::string image_name(const ImportContext& context, int image) {
  return element("image", static_cast<size_t>(image),
                 context.document.images[static_cast<size_t>(image)].name);
}

Expected<Bytes> read_image_bytes(const ImportContext& context, int image) {
  const auto& images = context.document.images;
  if (image < 0 || static_cast<size_t>(image) >= images.size())
    return context.bad(text("image {} does not exist, there are {}", image, images.size()));
  const GltfImage& at = images[static_cast<size_t>(image)];
  if (at.uri.empty()) {
    auto bytes = view_bytes(context, at.buffer_view);
    if (!bytes)
      return fail(bytes.error().kind, text("{} ({})", bytes.error().message, image_name(context, image)));
    return Bytes(bytes->begin(), bytes->end());
  }
  auto bytes = read_uri(context.document.path.parent_path(), at.uri);
  if (!bytes) return context.bad(text("{}: {}", image_name(context, image), bytes.error().message));
  return bytes;
}

int32_t TextureSet::add(const TextureRequest& request) {
  const auto [slot, is_new] = slots_.try_emplace(request, static_cast<int32_t>(requests_.size()));
  if (is_new) requests_.push_back(request);
  return slot->second;
}

Expected<std::vector<Texture>> TextureSet::decode(const ImportContext& context, ImportNotes& notes) {
  std::vector<Expected<Decoded>> decoded(requests_.size());
  MemoryGate gate(kDecodedAtOnce);
  parallel_for(requests_.size(), [&](size_t i) {
    if (!context.document.budget->is_spent()) decoded[i] = decode_one(context, requests_[i], gate);
  });
  KILN_TRY_STATUS(take_textures(context, 0));  // one refusal, whichever thread met it
  std::vector<Texture> textures;
  Finding reduced;
  index_.assign(requests_.size(), -1);
  for (size_t i = 0; i < decoded.size(); ++i) {
    if (!decoded[i]) {
      if (decoded[i].error().kind == ErrorKind::kInternal) return tl::unexpected(decoded[i].error());
      add_note(notes, ImportNote::Kind::kWarning,
               text("{}; the material's factor is used without it until that is mended",
                    decoded[i].error().message));
      continue;
    }
    if (decoded[i]->reduced) reduced.add(text("'{}'", decoded[i]->texture.name));
    index_[i] = static_cast<int32_t>(textures.size());
    textures.push_back(std::move(decoded[i]->texture));
  }
  if (!reduced.empty())
    add_note(notes, ImportNote::Kind::kBaked,
             text("diffuse light needs no more than {} texels a side ({} for alpha masks): reduced are {}",
                  kMaxSide, kMaxMaskSide, reduced.list("texture", "textures")));
  return textures;
}

}  // namespace kiln
