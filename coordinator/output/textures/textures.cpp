#include "coordinator/output/textures/textures.h"

#include <algorithm>
#include <cmath>

#include "common/atlas/texel_normals.h"
#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/output/textures/efforts.h"
#include "coordinator/output/textures/response_textures.h"
#include "coordinator/output/textures/texel_codec.h"
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
      : r_(request), folder_(folder), basis_(basis_of(request.settings)) {}

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
  // An encoding at the effort that its error asked for.
  struct Made {
    const Encoding* encoding;
    TextureFigures figures;
    std::vector<FinishedTexture> textures;
    std::vector<float> picture;
  };

  Status make(const Encoding& e, Quantity quantity, TextureResult& result) {
    KILN_TRY(Made made, make_within(e, quantity));
    if (made.figures.held > made.figures.bound && may_choose_format()) {
      KILN_TRY_STATUS(take_finer(quantity, made));
    }
    if (made.figures.within_bound) {
      KILN_TRY(WrittenFiles written,
               write_texture_files(*made.encoding, made.textures, r_.settings, folder_));
      made.figures.bytes = add_written(std::move(written), folder_, result);
    }
    KILN_TRY_STATUS(write_picture(made.figures, made.picture, result));
    result.error_pictures.push_back(std::move(made.picture));
    result.figures.push_back(std::move(made.figures));
    return {};
  }

  // Raises the effort until the bound holds, or where a higher one cannot help enough.
  Expected<Made> make_within(const Encoding& e, Quantity quantity) {
    constexpr double kWithinReach = 1.3;  // `best` takes at most about that off the rms of `normal`
    Made made{&e, {}, {}, {}};
    TextureFigures& figures = made.figures;
    figures.encoding = e.name;
    figures.quantity = quantity == Quantity::kBasis ? basis_.name : "irradiance";
    made.textures = lay_out(e, quantity, figures);
    const bool efforts = std::any_of(made.textures.begin(), made.textures.end(), has_effort);
    const bool automatic = r_.settings.max_encode_error == kAutoBound;
    const double bound = automatic ? automatic_bound() : r_.settings.max_encode_error;
    for (BlockEffort effort = effort_of(r_.settings.encode_effort);;
         effort = static_cast<BlockEffort>(static_cast<int>(effort) + 1)) {
      if (efforts) figures.effort = kEfforts[static_cast<int>(effort)];
      KILN_TRY_STATUS(compress(effort, made.textures, figures));
      KILN_TRY_STATUS(measure(made.textures, figures, made.picture));
      const double error = automatic ? figures.error.format : figures.error.relative_rms();
      const bool holds = !(bound > 0) || error <= bound;
      figures.within_bound = holds || automatic;
      if (automatic) figures.bound = bound, figures.held = error;
      if (holds || !efforts || effort == BlockEffort::kBest) break;
      if (automatic && (error > kWithinReach * bound || is_limited())) break;
    }
    return made;
  }

  // A higher effort takes ten times as long, another format as long again: no time limit has room for them.
  bool is_limited() const { return r_.settings.time_limit > 0; }
  // --encode not given: another format may take the place of the default.
  bool may_choose_format() const { return !r_.settings.source.contains("encode") && !is_limited(); }

  // Whether it holds the basis, and in other formats.
  bool may_replace(const Encoding& finer, const Encoding& e, Quantity quantity) const {
    const auto formats = [&](const Encoding& of) {
      std::vector<std::pair<TextureFormat, bool>> out;
      for (const TextureLayout& t : layouts_of(of, basis_, quantity))
        out.emplace_back(t.format, t.is_ratio());
      return out;
    };
    return holds(finer, basis_) && formats(finer) != formats(e);
  }

  // The first finer encoding within the bound, if there is one.
  Status take_finer(Quantity quantity, Made& made) {
    for (std::string_view name = made.encoding->finer; !name.empty(); name = encoding(name).finer) {
      if (!may_replace(encoding(name), *made.encoding, quantity)) continue;
      KILN_TRY(Made finer, make_within(encoding(name), quantity));
      if (finer.figures.held > finer.figures.bound) continue;
      finer.figures.instead_of = made.figures.encoding;
      finer.figures.held_of_it = made.figures.held;
      made = std::move(finer);
      return {};
    }
    return {};
  }

  // Half of the rms of the reported error over measured texels, relative as errors of textures are. What
  // texels as good as black may have missed is no reason for coarser textures of the others.
  double automatic_bound() const {
    constexpr double kLeast = 0.01, kShare = 0.5, kAsGoodAsBlack = 1e-3;
    const Planes& p = r_.lightmap.planes;
    const std::vector<float>&r = p.plane("E.R"), &g = p.plane("E.G"), &b = p.plane("E.B"),
          &error = p.plane("error");
    double mean = 0, squares = 0, count = 0;
    const auto is_measured = [&](size_t t) { return r_.lightmap.validity[t] == Validity::kMeasured; };
    for (size_t t = 0; t < r.size(); ++t)
      if (is_measured(t)) mean += double{luminance(Vec3(r[t], g[t], b[t]))}, ++count;
    if (!(mean > 0)) return kLeast;
    mean /= count;
    for (size_t t = 0; t < r.size(); ++t) {
      if (!is_measured(t) || !std::isfinite(error[t])) continue;
      const double e = luminance(Vec3(r[t], g[t], b[t]));
      if (e <= kAsGoodAsBlack * mean) continue;
      squares += double{error[t]} * error[t] / (e * e + 1e-4 * mean * mean);
    }
    return std::max(kLeast, kShare * std::sqrt(squares / count));
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
    figures.error = measure_texture_error(levels_[0], directional ? &basis_ : nullptr, normals_, decoded,
                                          exact, &picture, r_.measure_every);
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

namespace {

uint64_t files_of(const Encoding& e, const BakeSettings& settings) {
  return e.files == FileKind::kTexture ? (settings.ktx2 ? 1 : 0) + (settings.dds && e.dds ? 1 : 0) : 1;
}

uint64_t texture_bytes(TextureFormat format, uint64_t texels) {
  return image_bytes(format, 4096, 4096) * texels >> 24;
}

// Textures of light on disk, and in `most` the number of them that are made together.
uint64_t light_bytes(const Encoding& e, const BakeSettings& settings, uint64_t texels, uint64_t& most) {
  const BasisInfo& basis = basis_of(settings);
  uint64_t bytes = 0;
  for (const Quantity quantity : quantities(e, basis, settings)) {
    const std::vector<TextureLayout> layouts = layouts_of(e, basis, quantity);
    for (const TextureLayout& t : layouts) bytes += files_of(e, settings) * texture_bytes(t.format, texels);
    bytes += 4 * texels;  // encode_error_NAME.exr
    most = std::max<uint64_t>(most, layouts.size());
  }
  return bytes;
}

uint64_t response_bytes(const Encoding& e, const BakeSettings& settings, uint64_t texels) {
  uint64_t bytes = 0;
  if (!e.responses) return bytes;
  for (const uint32_t response : settings.quantities.responses) {
    const bool is_vector = response_roster()[response].stored.size() > 1;
    const TextureFormat format = is_vector ? e.responses->vector : e.responses->scalar;
    bytes += files_of(e, settings) * texture_bytes(format, texels) + 4 * texels;
  }
  return bytes;
}

}  // namespace

TextureNeeds texture_needs(const BakeSettings& settings, uint64_t texels) {
  TextureNeeds needs;
  if (settings.encodings.empty()) return needs;
  uint64_t most = settings.quantities.responses.empty() ? 0 : 1, planes = 0;
  for (const std::string& name : settings.encodings) {
    const Encoding& e = encoding(name);
    if (settings.quantities.light) needs.disk += light_bytes(e, settings, texels, most);
    needs.disk += response_bytes(e, settings, texels);
  }
  if (settings.mip_levels > 0) needs.disk += needs.disk / 3;
  if (settings.quantities.light) planes = 3 + 3 * basis_of(settings).functions.size();
  for (const uint32_t response : settings.quantities.responses)
    planes += response_roster()[response].stored.size();
  needs.memory = texels * (planes * 4 * 4 / 3 + most * 2 * 16 + 12 + 8);
  return needs;
}

Status check_encodings(const BakeSettings& settings) {
  const BasisInfo& basis = basis_of(settings);
  if (!settings.quantities.light || settings.encode_quantity == "irradiance") return {};
  for (const std::string& name : settings.encodings)
    if (!holds(encoding(name), basis))
      return fail(
          ErrorKind::kUsage,
          text("--encode {} has no negative numbers, and lobes of {} fitted by '{}' may be negative: use "
               "--encode bc6h, half or exr, or --sh-fit positive",
               name, basis.name, basis.fit));
  return {};
}

std::vector<std::string> coarse_textures(const TextureResult& result) {
  std::vector<std::string> out;
  for (const TextureFigures& f : result.figures) {
    if (!(f.held > f.bound)) continue;
    std::string_view finest = f.encoding;
    while (!encoding(finest).finer.empty()) finest = encoding(finest).finer;
    out.push_back(text(
        "textures {} ({}) are {:.2g} % rms off after decoding, more than half of the reported error and 1 % "
        "({:.2g} %): {}",
        f.encoding, f.quantity, 100 * f.held, 100 * f.bound,
        finest == f.encoding ? "--encode half, for engines that read it, has the least error"
                             : text("--encode {} has the least error; without --encode and --time-limit the "
                                    "smallest format within the bound is chosen",
                                    finest)));
  }
  return out;
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
