#include "coordinator/output/textures/texture_files.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/output/textures/pixel_codes.h"
#include "coordinator/output/textures/radiance.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

std::string file_name(const Encoding& e, const std::string& texture, std::string_view extension,
                      uint32_t page, uint32_t pages) {
  std::string name = "lightmap";
  if (e.files != FileKind::kExr && e.files != FileKind::kHdr) name += text("_{}", e.name);
  if (!texture.empty()) name += "_" + texture;
  if (pages > 1) name += text(".{}", page);
  return name + "." + std::string(extension);
}

PublishedTexture describe(const FinishedTexture& t, std::string uri, std::string_view container,
                          uint32_t page, uint32_t layers) {
  PublishedTexture p;
  p.uri = std::move(uri);
  p.container = container;
  p.format = texture_format(t.layout.format).name;
  p.unpack = unpack_name(t.layout.unpack);
  p.unpack_range = t.layout.unpack == Unpack::kRgbm ? 8 : 1;
  p.width = t.width;
  p.height = t.height;
  p.layers = layers;
  p.levels = static_cast<uint32_t>(t.levels.size());
  p.page = page;
  for (int c = 0; c < 3; ++c)
    if (!t.layout.plane[c].empty())
      p.channels.push_back({t.layout.plane[c], t.scale.scale, t.scale.bias, t.layout.times[c], {}});
  return p;
}

// Metadata for readers of the file alone; the glTF extension has the same.
std::vector<KtxNote> notes_of(const FinishedTexture& t) {
  std::vector<KtxNote> notes;
  std::string planes, times;
  for (int c = 0; c < 3; ++c) {
    if (t.layout.plane[c].empty()) continue;
    planes += (c ? "," : "") + t.layout.plane[c];
    if (t.layout.is_ratio()) times += (c ? "," : "") + t.layout.times[c];
  }
  notes.push_back({"KilnPlanes", planes});
  notes.push_back({"KilnScaleBias", text("{} {}", t.scale.scale, t.scale.bias)});
  if (!times.empty()) notes.push_back({"KilnTimes", times});
  return notes;
}

Status write_gpu(const Encoding& e, const FinishedTexture& t, bool ktx2, const BakeSettings& settings,
                 const std::filesystem::path& folder, WrittenFiles& out) {
  const char* extension = ktx2 ? "ktx2" : "dds";
  const TextureImages images{t.layout.format, t.width, t.height, t.levels};
  const std::string name = file_name(e, t.layout.name, extension, 0, 1);
  KILN_TRY(const Bytes file,
           ktx2 ? write_ktx2(images, static_cast<int>(settings.ktx2_zstd), notes_of(t)) : write_dds(images));
  KILN_TRY_STATUS(write_file_atomic(folder / name, file));
  out.names.push_back(name);
  out.list.back().textures.push_back(describe(t, name, extension, 0, t.pages));
  return {};
}

Status write_png_pages(const Encoding& e, const FinishedTexture& t, const std::filesystem::path& folder,
                       WrittenFiles& out) {
  const bool alpha = t.layout.unpack != Unpack::kNone && t.layout.unpack != Unpack::kSrgb;
  for (uint32_t page = 0; page < t.pages; ++page) {
    const Bytes& rgba = t.levels[0][page];
    std::vector<uint8_t> texels;
    for (size_t i = 0; i < rgba.size(); ++i)
      if (alpha || i % 4 != 3) texels.push_back(std::to_integer<uint8_t>(rgba[i]));
    KILN_TRY(const Bytes file, encode_png(t.width, t.height, texels, alpha ? 4 : 3));
    const std::string name = file_name(e, t.layout.name, "png", page, t.pages);
    KILN_TRY_STATUS(write_file_atomic(folder / name, file));
    out.names.push_back(name);
    out.list.back().textures.push_back(describe(t, name, "png", page, 1));
  }
  return {};
}

// The file reader decodes the file's own code, so the texture needs no unpacking.
Status write_hdr_pages(const Encoding& e, const FinishedTexture& t, const std::filesystem::path& folder,
                       WrittenFiles& out) {
  for (uint32_t page = 0; page < t.pages; ++page) {
    const std::string name = file_name(e, t.layout.name, "hdr", page, t.pages);
    KILN_TRY_STATUS(write_file_atomic(folder / name, write_radiance(t.width, t.height, t.levels[0][page])));
    out.names.push_back(name);
    out.list.back().textures.push_back(describe(t, name, "hdr", page, 1));
    out.list.back().textures.back().unpack = "none";
  }
  return {};
}

// All textures as layers of one file: L0.R ... L1z.B, in the planes' own scale.
Status write_exr_pages(const Encoding& e, std::span<const FinishedTexture> textures,
                       const std::filesystem::path& folder, WrittenFiles& out) {
  const FinishedTexture& first = textures.front();
  const size_t page_texels = size_t{first.width} * first.height;
  const bool alone = textures.size() == 1;  // E: an image like any other
  for (uint32_t page = 0; page < first.pages; ++page) {
    std::vector<std::vector<float>> planes;
    std::vector<ExrChannel> channels;
    planes.reserve(3 * textures.size());
    const std::string name = file_name(e, alone ? first.layout.name : "", "exr", page, first.pages);
    for (const FinishedTexture& t : textures)
      for (size_t c = 0; c < 3; ++c) {
        std::vector<float>& plane = planes.emplace_back(page_texels);
        for (size_t i = 0; i < page_texels; ++i) plane[i] = t.values[4 * (page * page_texels + i) + c];
        channels.push_back({alone ? std::string(1, "RGB"[c]) : t.layout.plane[c], plane.data()});
      }
    KILN_TRY_STATUS(write_exr(folder / name, first.width, first.height, channels, ExrType::kHalf));
    out.names.push_back(name);
    for (const FinishedTexture& t : textures) {
      PublishedTexture& published = out.list.back().textures.emplace_back(describe(t, name, "exr", page, 1));
      for (TextureChannel& c : published.channels)
        if (!alone) c.name = c.plane;
    }
  }
  return {};
}

}  // namespace

void add_published(TextureList added, TextureList& list) {
  for (PublishedEncoding& one : added) {
    const auto same = std::find_if(list.begin(), list.end(), [&](const PublishedEncoding& o) {
      return o.name == one.name && o.container == one.container;
    });
    if (same == list.end())
      list.push_back(std::move(one));
    else
      same->textures.insert(same->textures.end(), one.textures.begin(), one.textures.end());
  }
}

Expected<WrittenFiles> write_texture_files(const Encoding& e, std::span<const FinishedTexture> textures,
                                           const BakeSettings& settings,
                                           const std::filesystem::path& folder) {
  WrittenFiles out;
  const auto begin = [&](const char* container) { out.list.push_back({std::string(e.name), container, {}}); };
  switch (e.files) {
    case FileKind::kTexture:
      for (const bool ktx2 : {false, true}) {
        if (ktx2 ? !settings.ktx2 : !settings.dds || !e.dds) continue;
        begin(ktx2 ? "ktx2" : "dds");
        for (const FinishedTexture& t : textures)
          KILN_TRY_STATUS(write_gpu(e, t, ktx2, settings, folder, out));
      }
      break;
    case FileKind::kPng:
      begin("png");
      for (const FinishedTexture& t : textures) KILN_TRY_STATUS(write_png_pages(e, t, folder, out));
      break;
    case FileKind::kHdr:
      begin("hdr");
      for (const FinishedTexture& t : textures) KILN_TRY_STATUS(write_hdr_pages(e, t, folder, out));
      break;
    case FileKind::kExr:
      begin("exr");
      KILN_TRY_STATUS(write_exr_pages(e, textures, folder, out));
      break;
  }
  return out;
}

}  // namespace kiln
