#include "coordinator/output/textures/texture_values.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "coordinator/output/textures/texel_codec.h"

namespace kiln {
namespace {

constexpr size_t kPart = size_t{1} << 16;

struct Source {
  const std::vector<float>* plane[3];
  const std::vector<float>* times[3];  // null: none

  Source(const TextureLayout& layout, const Planes& planes) {
    for (int c = 0; c < 3; ++c) {
      plane[c] = &planes.plane(layout.plane[c]);
      times[c] = layout.is_ratio() ? &planes.plane(layout.times[c]) : nullptr;
    }
  }
  double value(int c, size_t t) const {
    const double v = (*plane[c])[t];
    if (!times[c]) return v;
    const double by = (*times[c])[t];
    return by != 0 ? v / by : std::isnan(by) ? by : 0;
  }
};

TextureScale fitted_ratio(const Source& source, const MapLevel& level) {
  double low = 1, high = -1;
  for (size_t t = 0; t < level.weight.size(); ++t)
    if (level.weight[t] == 1)
      for (int c = 0; c < 3; ++c) {
        const double v = std::clamp(source.value(c, t), -1.0, 1.0);
        if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
      }
  if (!(low < high)) return {2, -1};
  return {high - low, low};
}

}  // namespace

TextureScale choose_scale(const TextureLayout& layout, const MapLevel& level, bool fit, double unit_factor) {
  const Source source(layout, level.planes);
  const bool unorm = value_range(layout.format, layout.unpack).highest == 1 && layout.unpack == Unpack::kNone;
  if (layout.is_ratio()) {
    // Half floats store a ratio directly.
    if (!unorm) return {1, 0};
    return fit ? fitted_ratio(source, level) : TextureScale{2, -1};
  }
  double most = 0;
  for (size_t t = 0; t < level.weight.size(); ++t)
    if (level.weight[t] == 1)
      for (int c = 0; c < 3; ++c) {
        const double v = std::abs(source.value(c, t)) / unit_factor;
        if (std::isfinite(v)) most = std::max(most, v);
      }
  const double highest = value_range(layout.format, layout.unpack).highest;
  double scale = 1;
  if (layout.unpack == Unpack::kRgbm || layout.unpack == Unpack::kRgbd || layout.unpack == Unpack::kSrgb)
    while (most > highest * scale) scale *= 2;
  else if (most > 0 && (most > highest || most < 1.0 / 64))
    scale = std::exp2(std::floor(std::log2(most)) - 13);
  return {scale * unit_factor, 0};
}

TextureWeights texture_weights(const TextureLayout& layout, const MapLevel& level, const TextureScale& scale,
                               BlockMetric metric) {
  const std::vector<float>* light[3];
  for (size_t c = 0; c < 3; ++c) light[c] = &level.planes.plane(layout.light[c]);
  const auto luminance_at = [&](size_t t) {
    const float l = luminance(Vec3((*light[0])[t], (*light[1])[t], (*light[2])[t]));
    return std::isfinite(l) ? std::max(0.0, double{l}) : 0.0;
  };
  double sum = 0;
  uint64_t count = 0;
  for (size_t t = 0; t < level.owner.size(); ++t)
    if (level.owner[t]) sum += luminance_at(t), ++count;
  const double floor = count ? sum / static_cast<double>(count) / 100 : 0;
  TextureWeights w;
  // The encoder's relative metrics suit light only; directions have no natural zero.
  w.metric = layout.is_signed ? BlockMetric::kLinear : metric;
  w.encode = level.weight;
  w.norm.resize(level.weight.size(), 1.0f);
  if (!(floor > 0)) return w;
  for (size_t t = 0; t < w.norm.size(); ++t) {
    const double l = luminance_at(t), square = l * l + floor * floor, lit = std::max(l, floor / 4);
    const double share = lit * lit / (lit * lit + floor * floor);
    w.norm[t] = static_cast<float>(layout.is_ratio() ? share : scale.scale * scale.scale / square);
    if (metric == BlockMetric::kLinear) continue;
    w.encode[t] *=
        static_cast<float>(layout.is_signed && !layout.is_ratio() ? floor * floor / square : share);
  }
  return w;
}

std::vector<float> texture_values(const TextureLayout& layout, const MapLevel& level,
                                  const TextureScale& scale, uint64_t* clamped) {
  const Source source(layout, level.planes);
  const ValueRange range = value_range(layout.format, layout.unpack);
  const size_t count = level.weight.size(), parts = (count + kPart - 1) / kPart;
  std::vector<float> out(4 * count);
  std::vector<uint64_t> beyond(parts, 0);
  const double slack = 1e-6 * (double{range.highest} - range.lowest);
  parallel_for(parts, [&](size_t part) {
    for (size_t t = part * kPart; t < std::min(count, (part + 1) * kPart); ++t) {
      for (int c = 0; c < 3; ++c) {
        const double v = (source.value(c, t) - scale.bias) / scale.scale;
        if (level.weight[t] == 1 && (v < range.lowest - slack || v > range.highest + slack)) ++beyond[part];
        out[4 * t + c] =
            static_cast<float>(std::isfinite(v) ? std::clamp<double>(v, range.lowest, range.highest) : v);
      }
      out[4 * t + 3] = 1;
    }
  });
  if (clamped)
    for (const uint64_t n : beyond) *clamped += n;
  return out;
}

void lookup_planes(std::span<const DecodedTexture> textures, std::span<const size_t> texel,
                   std::span<const float> weight, float* planes) {
  for (size_t k = 0; k < textures.size(); ++k) {
    const DecodedTexture& d = textures[k];
    const Unpack unpack = d.layout->unpack;
    const bool before = unpack == Unpack::kRgbe || unpack == Unpack::kSrgb;
    float rgb[3] = {0, 0, 0}, filtered[4] = {0, 0, 0, 0};
    for (size_t i = 0; i < texel.size(); ++i) {
      const float* c = &d.texels[4 * texel[i]];
      if (before) {
        float one[3];
        unpack_texel(unpack, c, one);
        for (int j = 0; j < 3; ++j) rgb[j] += weight[i] * one[j];
      } else {
        for (int j = 0; j < 4; ++j) filtered[j] += weight[i] * c[j];
      }
    }
    if (!before) unpack_texel(unpack, filtered, rgb);
    for (int j = 0; j < 3; ++j) {
      planes[3 * k + j] = static_cast<float>(d.scale.scale * rgb[j] + d.scale.bias);
      // A ratio's denominator comes first among the layouts.
      if (d.layout->is_ratio()) planes[3 * k + j] *= planes[j];
    }
  }
}

}  // namespace kiln
