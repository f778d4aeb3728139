#include "coordinator/output/textures/texture_files.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/output/context/context.h"
#include "coordinator/output/textures/pixel_codes.h"
#include "coordinator/output/textures/radiance.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

// What an 8-bit file holds, or the texel format.
std::string format_word(const Encoding& e, const TextureLayout& layout) {
  if (e.files != FileKind::kPng) return std::string(texture_format(layout.format).word);
  return layout.unpack == Unpack::kNone ? "rgb8" : std::string(unpack_name(layout.unpack));
}

// Without extension. EXR and HDR have one format each, which the extension says.
std::string file_name(const Encoding& e, const FinishedTexture& t, uint32_t page, uint32_t pages) {
  std::string name = "lightmap_";
  if (e.files != FileKind::kHdr) name += format_word(e, t.layout) + "_";
  name += t.layout.name;
  return pages > 1 ? text("{}.{}", name, page) : name;
}

std::string exr_name(const FinishedTexture* alone, uint32_t page, uint32_t pages) {
  return page_name(alone ? "lightmap_" + alone->layout.name : "lightmap", "exr", page, pages);
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
                 TextureFolder& folder, WrittenFiles& out) {
  const char* extension = ktx2 ? "ktx2" : "dds";
  const TextureImages images{t.layout.format, t.width, t.height, t.levels};
  KILN_TRY(const Bytes file,
           ktx2 ? write_ktx2(images, static_cast<int>(settings.ktx2_zstd), notes_of(t)) : write_dds(images));
  KILN_TRY(const std::string name, folder.write(file_name(e, t, 0, 1), std::string(e.name), extension, file));
  out.names.push_back(name);
  out.list.back().textures.push_back(describe(t, name, extension, 0, t.pages));
  return {};
}

Status write_png_pages(const Encoding& e, const FinishedTexture& t, TextureFolder& folder,
                       WrittenFiles& out) {
  const bool alpha = t.layout.unpack != Unpack::kNone && t.layout.unpack != Unpack::kSrgb;
  for (uint32_t page = 0; page < t.pages; ++page) {
    const Bytes& rgba = t.levels[0][page];
    std::vector<uint8_t> texels;
    for (size_t i = 0; i < rgba.size(); ++i)
      if (alpha || i % 4 != 3) texels.push_back(std::to_integer<uint8_t>(rgba[i]));
    KILN_TRY(const Bytes file, encode_png(t.width, t.height, texels, alpha ? 4 : 3));
    KILN_TRY(const std::string name,
             folder.write(file_name(e, t, page, t.pages), std::string(e.name), "png", file));
    out.names.push_back(name);
    out.list.back().textures.push_back(describe(t, name, "png", page, 1));
  }
  return {};
}

// The file reader decodes the file's own code, so the texture needs no unpacking.
Status write_hdr_pages(const Encoding& e, const FinishedTexture& t, TextureFolder& folder,
                       WrittenFiles& out) {
  for (uint32_t page = 0; page < t.pages; ++page) {
    KILN_TRY(const std::string name, folder.write(file_name(e, t, page, t.pages), std::string(e.name), "hdr",
                                                  write_radiance(t.width, t.height, t.levels[0][page])));
    out.names.push_back(name);
    out.list.back().textures.push_back(describe(t, name, "hdr", page, 1));
    out.list.back().textures.back().unpack = "none";
  }
  return {};
}

ExrNotes exr_notes(std::span<const FinishedTexture> textures, const BakeSettings& settings) {
  if (textures.size() > 1)
    return {{"quantity", std::string(basis_roster()[*find_basis(settings.basis)].about)},
            {"unit", kRadianceUnit},
            {"basis", settings.basis},
            {"fit", std::string(fit_name(settings))}};
  const bool over_pi = settings.encode_units == "e-over-pi";
  return {{"quantity",
           over_pi ? "irradiance E at the surface normal / pi" : "irradiance E at the surface normal"},
          {"unit", over_pi ? kRadianceUnit : kIrradianceUnit},
          {"basis", "none"},
          {"fit", "none"}};
}

// All textures as layers of one file: L0.R ... L1z.B, in the planes' own scale.
Status write_exr_pages(std::span<const FinishedTexture> textures, const ExrNotes& notes,
                       const std::filesystem::path& folder, WrittenFiles& out) {
  const FinishedTexture& first = textures.front();
  const size_t page_texels = size_t{first.width} * first.height;
  const bool alone = textures.size() == 1;  // E: an image like any other
  for (uint32_t page = 0; page < first.pages; ++page) {
    std::vector<std::vector<float>> planes;
    std::vector<ExrChannel> channels;
    planes.reserve(3 * textures.size());
    const std::string name = exr_name(alone ? &first : nullptr, page, first.pages);
    for (const FinishedTexture& t : textures)
      for (size_t c = 0; c < 3; ++c) {
        std::vector<float>& plane = planes.emplace_back(page_texels);
        for (size_t i = 0; i < page_texels; ++i) plane[i] = t.values[4 * (page * page_texels + i) + c];
        channels.push_back({alone ? std::string(1, "RGB"[c]) : t.layout.plane[c], plane.data()});
      }
    KILN_TRY_STATUS(write_exr(folder / name, first.width, first.height, channels, {ExrType::kHalf}, notes));
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

Expected<std::string> TextureFolder::write(const std::string& name, const std::string& encoding,
                                           std::string_view extension, std::span<const std::byte> bytes) {
  const Digest digest = sha256(bytes);
  std::string file = text("{}.{}", name, extension);
  if (const auto there = written_.find(file); there != written_.end()) {
    if (there->second == digest) return file;
    file = text("{}-{}.{}", name, encoding, extension);
  }
  KILN_TRY_STATUS(write_file_atomic(path_ / file, bytes));
  written_[file] = digest;
  return file;
}

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
                                           const BakeSettings& settings, TextureFolder& folder) {
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
      KILN_TRY_STATUS(write_exr_pages(textures, exr_notes(textures, settings), folder.path(), out));
      break;
  }
  return out;
}

}  // namespace kiln
