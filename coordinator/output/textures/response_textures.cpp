#include "coordinator/output/textures/response_textures.h"

#include <algorithm>
#include <cmath>

#include "common/base/clock.h"
#include "coordinator/output/textures/efforts.h"
#include "coordinator/output/textures/texel_codec.h"
#include "coordinator/output/textures/texture_files.h"

namespace kiln {
namespace {

class ResponseTexture {
 public:
  ResponseTexture(const EncodeTextures& request, const std::vector<MapLevel>& levels,
                  const Encoding& encoding, const ResponseInfo& response)
      : r_(request), levels_(levels), encoding_(encoding), response_(response) {
    const bool is_vector = response.stored.size() > 1;
    texture_.layout.name = response.name;
    texture_.layout.format = is_vector ? encoding.responses->vector : encoding.responses->scalar;
    for (size_t c = 0; c < response.stored.size(); ++c)
      texture_.layout.plane[c] = response_plane(response, c);
    texture_.layout.is_signed = response.is_signed;
    if (response.is_signed && value_range(texture_.layout.format, Unpack::kNone).lowest >= 0)
      texture_.scale = {2, -1};
    texture_.width = levels[0].planes.width;
    texture_.height = levels[0].page_height;
    texture_.pages = levels[0].pages;
  }

  Status make(TextureFolder& folder, TextureResult& result) {
    const Stopwatch watch;
    const TextureFormatInfo& format = texture_format(texture_.layout.format);
    const BlockEffort effort = effort_of(r_.settings.encode_effort);
    TextureFigures figures;
    figures.encoding = encoding_.name;
    figures.quantity = response_.name;
    figures.is_light = false;
    if (format.block_x > 1) figures.effort = r_.settings.encode_effort;
    figures.bits = 8.0 * format.bytes / (format.block_x * format.block_y);
    KILN_TRY_STATUS(compress(effort, figures));
    figures.seconds = watch.seconds();
    std::vector<float> picture;
    KILN_TRY_STATUS(measure(figures, picture));
    KILN_TRY(WrittenFiles written, write_texture_files(encoding_, {&texture_, 1}, r_.settings, folder));
    figures.bytes = add_written(std::move(written), folder, result);
    result.error_pictures.push_back(std::move(picture));
    result.figures.push_back(std::move(figures));
    return {};
  }

 private:
  // 4 a texel: one value in all three colours, alpha 1.
  std::vector<float> values_of(const MapLevel& level, uint64_t& clamped) const {
    const ValueRange range = value_range(texture_.layout.format, Unpack::kNone);
    const size_t stored = response_.stored.size();
    std::vector<float> out(4 * level.weight.size(), 1.0f);
    for (size_t c = 0; c < 3; ++c) {
      const std::vector<float>& plane = level.planes.plane(texture_.layout.plane[std::min(c, stored - 1)]);
      for (size_t t = 0; t < plane.size(); ++t) {
        const double v = (plane[t] - texture_.scale.bias) / texture_.scale.scale;
        const double held = std::clamp<double>(std::isfinite(v) ? v : 0.0, range.lowest, range.highest);
        // Means of samples pass 1 by their noise: only what is beyond that is worth counting.
        clamped += c < stored && level.weight[t] == 1 && std::abs(v - held) > kNoise;
        out[4 * t + c] = static_cast<float>(held);
      }
    }
    return out;
  }

  Status compress(BlockEffort effort, TextureFigures& figures) {
    for (const MapLevel& level : levels_) {
      uint64_t clamped = 0;
      std::vector<float> values = values_of(level, clamped);
      std::vector<Bytes> pages;
      for (uint32_t page = 0; page < level.pages; ++page) {
        const size_t first = page * level.page_texels();
        const BlockImage image{level.planes.width, level.page_height,
                               std::span(values).subspan(4 * first, 4 * level.page_texels()),
                               std::span(level.weight).subspan(first, level.page_texels())};
        KILN_TRY(pages.emplace_back(), encode_texels(texture_.layout.format, Unpack::kNone, image,
                                                     {effort, BlockMetric::kLinear, false}));
      }
      texture_.levels.push_back(std::move(pages));
      if (texture_.levels.size() > 1) continue;
      figures.clamped = clamped;
      figures.texels = level.weight.size();
      texture_.values = std::move(values);
    }
    return {};
  }

  // Root of the mean square of what decoded values of a texel differ by, in the response's own unit.
  Status measure(TextureFigures& figures, std::vector<float>& picture) const {
    const MapLevel& level = levels_[0];
    picture.assign(level.weight.size(), 0.0f);
    TextureError& error = figures.error;
    double sum = 0;
    for (uint32_t page = 0; page < level.pages; ++page) {
      KILN_TRY(
          const std::vector<float> decoded,
          decode_texels(texture_.layout.format, texture_.levels[0][page], texture_.width, texture_.height));
      for (size_t i = 0; i < level.page_texels(); ++i) {
        const size_t t = page * level.page_texels() + i;
        if (level.weight[t] != 1) continue;
        double square = 0;
        for (size_t c = 0; c < response_.stored.size(); ++c) {
          const double d = texture_.scale.scale * (double{decoded[4 * i + c]} - texture_.values[4 * t + c]);
          square += d * d;
        }
        sum += square;
        ++error.texels;
        picture[t] = static_cast<float>(std::sqrt(square));
        if (picture[t] > error.worst_texel.error)
          error.worst_texel = {page, static_cast<uint32_t>(i % texture_.width),
                               static_cast<uint32_t>(i / texture_.width), picture[t]};
      }
    }
    error.rel_mse = error.rel_mse_texels = error.texels ? sum / static_cast<double>(error.texels) : 0;
    return {};
  }

  static constexpr double kNoise = 0.02;

  const EncodeTextures& r_;
  const std::vector<MapLevel>& levels_;
  const Encoding& encoding_;
  const ResponseInfo& response_;
  FinishedTexture texture_;
};

}  // namespace

uint64_t add_written(WrittenFiles written, const TextureFolder& folder, TextureResult& result) {
  uint64_t bytes = 0;
  for (const std::string& name : written.names) {
    std::error_code ignored;
    bytes += std::filesystem::file_size(folder.path() / name, ignored);
    if (std::find(result.files.begin(), result.files.end(), name) == result.files.end())
      result.files.push_back(name);
  }
  add_published(std::move(written.list), result.list);
  return bytes;
}

Status make_response_textures(const EncodeTextures& request, TextureFolder& folder, TextureResult& result) {
  const std::vector<uint32_t>& responses = request.settings.quantities.responses;
  if (responses.empty()) return {};
  Lightmap map;
  map.page_height = request.lightmap.page_height;
  map.planes = request.lightmap.responses;
  map.validity = request.lightmap.validity;
  const std::vector<MapLevel> levels = map_levels(map, request.atlas, request.settings.mip_levels);
  for (const std::string& name : request.settings.encodings) {
    if (!encoding(name).responses) continue;
    for (const uint32_t response : responses)
      KILN_TRY_STATUS(
          ResponseTexture(request, levels, encoding(name), response_roster()[response]).make(folder, result));
  }
  return {};
}

}  // namespace kiln
