#include "coordinator/output/textures/textures.h"

#include <algorithm>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/output/textures/efforts.h"
#include "coordinator/output/textures/response_textures.h"
#include "coordinator/output/textures/texel_codec.h"
#include "coordinator/output/textures/texel_normals.h"
#include "coordinator/output/textures/texture_files.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

constexpr uint32_t kSeamStride = 3;

bool has_effort(const FinishedTexture& t) {
  return texture_format(t.layout.format).block_x > 1;
}

std::vector<Quantity> quantities(const Encoding& e, const BasisInfo& basis, const BakeSettings& settings) {
  const std::string& q = settings.encode_quantity;
  if (basis.functions.empty() || !e.directional || q == "irradiance") return {Quantity::kIrradiance};
  if (q == "both") return {Quantity::kBasis, Quantity::kIrradiance};
  return {Quantity::kBasis};
}

// Shared by all encodings of a bake.
class Maker {
 public:
  Maker(const EncodeTextures& request, TextureFolder& folder)
      : r_(request), folder_(folder), basis_(basis_roster()[*find_basis(request.settings.basis)]) {}

  Expected<TextureResult> run() {
    TextureResult result;
    if (r_.settings.encodings.empty()) return result;
    levels_ = map_levels(r_.lightmap, r_.atlas, r_.settings.mip_levels);
    for (const std::string& name : r_.settings.encodings)
      for (const Quantity quantity : quantities(encoding(name), basis_, r_.settings))
        KILN_TRY_STATUS(make(encoding(name), quantity, result));
    return result;
  }

 private:
  Status make(const Encoding& e, Quantity quantity, TextureResult& result) {
    TextureFigures figures;
    figures.encoding = e.name;
    figures.quantity = quantity == Quantity::kBasis ? basis_.name : "irradiance";
    std::vector<FinishedTexture> textures = lay_out(e, quantity, figures);
    const bool efforts = std::any_of(textures.begin(), textures.end(), has_effort);
    std::vector<float> picture;
    for (BlockEffort effort = effort_of(r_.settings.encode_effort);;
         effort = static_cast<BlockEffort>(static_cast<int>(effort) + 1)) {
      if (efforts) figures.effort = kEfforts[static_cast<int>(effort)];
      KILN_TRY_STATUS(compress(effort, textures, figures));
      KILN_TRY_STATUS(measure(textures, figures, picture));
      const double bound = r_.settings.max_encode_error;
      figures.within_bound = !(bound > 0) || figures.error.relative_rms() <= bound;
      if (figures.within_bound || !efforts || effort == BlockEffort::kBest) break;
    }
    if (figures.within_bound) {
      KILN_TRY(WrittenFiles written, write_texture_files(e, textures, r_.settings, folder_));
      figures.bytes = add_written(std::move(written), folder_, result);
    }
    KILN_TRY_STATUS(write_picture(figures, picture, result));
    result.error_pictures.push_back(std::move(picture));
    result.figures.push_back(std::move(figures));
    return {};
  }

  Status write_picture(const TextureFigures& f, const std::vector<float>& picture,
                       TextureResult& result) const {
    const MapLevel& level = levels_[0];
    const std::string stem =
        text("encode_error_{}{}", f.encoding, f.quantity == basis_.name ? "" : "_irradiance");
    for (uint32_t page = 0; page < level.pages; ++page) {
      const std::string name = level.pages == 1 ? stem + ".exr" : text("{}.{}.exr", stem, page);
      const ExrChannel channel{"Y", picture.data() + page * level.page_texels()};
      KILN_TRY_STATUS(write_exr(folder_.path() / name, level.planes.width, level.page_height, {&channel, 1},
                                {ExrType::kHalf},
                                {{"quantity", text("rms error of {} after decoding, relative", f.encoding)},
                                 {"unit", "1"},
                                 {"basis", "none"},
                                 {"fit", "none"}}));
      result.files.push_back(name);
    }
    return {};
  }

  std::vector<FinishedTexture> lay_out(const Encoding& e, Quantity quantity, TextureFigures& figures) const {
    const double units =
        quantity == Quantity::kIrradiance && r_.settings.encode_units == "e-over-pi" ? double{kPi} : 1.0;
    std::vector<FinishedTexture> textures;
    for (TextureLayout& layout : layouts_of(e, basis_, quantity)) {
      FinishedTexture t;
      t.scale = choose_scale(layout, levels_[0], r_.settings.encode_range == "fit", units);
      t.width = levels_[0].planes.width;
      t.height = levels_[0].page_height;
      t.pages = levels_[0].pages;
      t.values = texture_values(layout, levels_[0], t.scale, &figures.clamped);
      t.layout = std::move(layout);
      const TextureFormatInfo& f = texture_format(t.layout.format);
      figures.bits += 8.0 * f.bytes / (f.block_x * f.block_y);
      figures.texels += t.values.size() / 4;
      textures.push_back(std::move(t));
    }
    return textures;
  }

  Status compress(BlockEffort effort, std::vector<FinishedTexture>& textures, TextureFigures& figures) {
    const Stopwatch watch;
    figures.seams.reset();
    for (FinishedTexture& t : textures) {
      const BlockMetric metric = metric_of(r_.settings.encode_metric);
      t.levels.clear();
      for (size_t k = 0; k < levels_.size(); ++k) {
        const MapLevel& level = levels_[k];
        std::vector<float> smaller;
        if (k > 0) smaller = texture_values(t.layout, level, t.scale);
        const std::vector<float>& values = k == 0 ? t.values : smaller;
        const TextureWeights weights = texture_weights(t.layout, level, t.scale, metric);
        const BlockChoice choice{effort, weights.metric, false};
        std::vector<Bytes> pages;
        for (uint32_t page = 0; page < level.pages; ++page) {
          const size_t first = page * level.page_texels();
          const BlockImage image{level.planes.width, level.page_height,
                                 std::span(values).subspan(4 * first, 4 * level.page_texels()),
                                 std::span(weights.encode).subspan(first, level.page_texels())};
          auto bytes = encode_texels(t.layout.format, t.layout.unpack, image, choice);
          if (!bytes)
            return fail(bytes.error().kind, text("texture {} of page {}, level {}: {}", t.layout.name, page,
                                                 k, bytes.error().message));
          pages.push_back(std::move(*bytes));
        }
        t.levels.push_back(std::move(pages));
      }
      KILN_TRY_STATUS(join_blocks(t, effort, figures));
    }
    figures.seconds = watch.seconds();
    return {};
  }

  // Matches both sides of seams as closely as blocks allow, at level 0.
  Status join_blocks(FinishedTexture& t, BlockEffort effort, TextureFigures& figures) {
    const BlockFormat* format = block_format(t.layout.format);
    if (!format || !r_.settings.seams) return {};
    if (!equations_) equations_ = find_equations();
    if (equations_->empty()) return {};
    KILN_TRY(std::vector<float> decoded, decode(t));
    SeamBlocks blocks;
    blocks.format = format;
    TextureWeights weights =
        texture_weights(t.layout, levels_[0], t.scale, metric_of(r_.settings.encode_metric));
    for (size_t i = 0; i < weights.norm.size(); ++i) weights.norm[i] *= levels_[0].weight[i];
    blocks.choice = {effort, weights.metric, false};
    blocks.width = t.width;
    blocks.page_height = t.height;
    blocks.target = t.values;
    blocks.weight = weights.encode;
    blocks.norm = weights.norm;
    blocks.pages = &t.levels[0];
    blocks.decoded = &decoded;
    const SeamMatch match = match_seams(blocks, *equations_);
    if (!figures.seams || match.rms_before > figures.seams->rms_before) figures.seams = match;
    return {};
  }

  std::vector<SeamEquation> find_equations() const {
    SeamFinder own(r_.scene, r_.atlas);
    SeamFinder& seams = r_.seams ? *r_.seams : own;
    std::vector<SeamEquation> equations =
        seam_equations(r_.atlas, r_.lightmap, seams.find(r_.settings.seam_angle).points);
    // Eight points a texel suit a solve that must agree everywhere. Blocks cannot, and lookups are linear
    // between texels.
    std::vector<SeamEquation> some;
    for (size_t i = 0; i < equations.size(); i += kSeamStride) {
      some.push_back(equations[i]);
      some.back().texels *= kSeamStride;
    }
    return some;
  }

  static Expected<std::vector<float>> decode(const FinishedTexture& t) {
    std::vector<float> all;
    all.reserve(t.values.size());
    for (const Bytes& page : t.levels[0]) {
      KILN_TRY(const std::vector<float> texels, decode_texels(t.layout.format, page, t.width, t.height));
      all.insert(all.end(), texels.begin(), texels.end());
    }
    return all;
  }

  Status measure(const std::vector<FinishedTexture>& textures, TextureFigures& figures,
                 std::vector<float>& picture) {
    const bool directional = textures.size() > 1;
    if (directional && normals_.empty()) normals_ = texel_normals(r_.scene, r_.atlas);
    std::vector<TextureLayout> plain;  // the same without an 8-bit code
    for (const FinishedTexture& t : textures) {
      plain.push_back(t.layout);
      plain.back().unpack = Unpack::kNone;
    }
    std::vector<std::vector<float>> texels;
    std::vector<DecodedTexture> decoded, exact;
    for (const FinishedTexture& t : textures) {
      KILN_TRY(texels.emplace_back(), decode(t));
    }
    for (size_t k = 0; k < textures.size(); ++k) {
      decoded.push_back({&textures[k].layout, textures[k].scale, texels[k]});
      exact.push_back({&plain[k], textures[k].scale, textures[k].values});
    }
    figures.error = measure_texture_error(levels_[0], normals_, decoded, exact, &picture, r_.measure_every);
    return {};
  }

  const EncodeTextures& r_;
  TextureFolder& folder_;
  const BasisInfo& basis_;
  std::vector<MapLevel> levels_;
  std::vector<Vec3> normals_;
  std::optional<std::vector<SeamEquation>> equations_;
};

}  // namespace

Expected<TextureResult> make_textures(const EncodeTextures& request) {
  TextureResult result;
  TextureFolder folder(request.folder);
  if (request.lightmap.has_light) {
    KILN_TRY(result, Maker(request, folder).run());
  }
  KILN_TRY_STATUS(make_response_textures(request, folder, result));
  return result;
}

TextureNeeds texture_needs(const BakeSettings& settings, uint64_t texels) {
  const BasisInfo& basis = basis_roster()[*find_basis(settings.basis)];
  TextureNeeds needs;
  if (settings.encodings.empty() || !settings.quantities.light) return needs;
  uint64_t most = 0;
  for (const std::string& name : settings.encodings) {
    const Encoding& e = encoding(name);
    const uint64_t files =
        e.files == FileKind::kTexture ? (settings.ktx2 ? 1 : 0) + (settings.dds && e.dds ? 1 : 0) : 1;
    for (const Quantity quantity : quantities(e, basis, settings)) {
      const std::vector<TextureLayout> layouts = layouts_of(e, basis, quantity);
      for (const TextureLayout& t : layouts)
        needs.disk += files * image_bytes(t.format, 4096, 4096) * texels >> 24;
      needs.disk += 4 * texels;  // encode_error_NAME.exr
      most = std::max<uint64_t>(most, layouts.size());
    }
  }
  if (settings.mip_levels > 0) needs.disk += needs.disk / 3;
  const uint64_t planes = 3 + 3 * basis.functions.size();
  needs.memory = texels * (planes * 4 * 4 / 3 + most * 2 * 16 + 12 + 8);
  return needs;
}

std::string beyond_bound(const TextureResult& result, const BakeSettings& settings) {
  std::string out;
  for (const TextureFigures& f : result.figures)
    if (!f.within_bound)
      out += text("{}{} ({}): {:.3g} % rms at effort {}", out.empty() ? "" : "; ", f.encoding, f.quantity,
                  100 * f.error.relative_rms(), f.effort.empty() ? "none" : f.effort);
  if (out.empty()) return out;
  return text(
      "textures have more error after decoding than --max-encode-error {} and were not written: {}. The "
      "masters and the "
      "other files are complete; choose another --encode or a larger bound",
      settings.max_encode_error, out);
}

}  // namespace kiln
