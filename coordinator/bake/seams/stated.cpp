#include "coordinator/bake/seams/stated.h"

namespace kiln {
namespace {

// Squared correction of texel i in functions with consecutive planes by colour: E, or a band.
double squared_move(const Lightmap& map, const SeamBackup& before, const std::vector<size_t>& first,
                    uint32_t texel, size_t i) {
  double square = 0;
  for (const size_t k : first) {
    DVec3 move;
    for (int c = 0; c < 3; ++c)
      move[c] = std::abs(double{map.planes.data[before.planes[k + size_t(c)]][texel]} -
                         double{before.values[k + size_t(c)][i]});
    square += luminance(move) * luminance(move);
  }
  return square;
}

void raise(std::vector<float>& stated, const Lightmap& map, std::span<const uint32_t> texels,
           const SeamBackup& before, const std::vector<size_t>& first) {
  for (size_t i = 0; i < texels.size(); ++i) {
    const double moved = std::sqrt(squared_move(map, before, first, texels[i], i));
    float& s = stated[texels[i]];
    if (moved > 0 && std::isfinite(s)) s = static_cast<float>(stated_after_move(double{s}, moved));
  }
}

// Indices in before.planes of the red planes with this name prefix.
std::vector<size_t> red_planes(const Lightmap& map, const SeamBackup& before, const std::string& prefix) {
  std::vector<size_t> first;
  for (size_t k = 0; k + 2 < before.planes.size(); ++k) {
    const std::string& name = map.planes.names[before.planes[k]];
    if (name.starts_with(prefix) && name.ends_with(".R")) first.push_back(k);
  }
  return first;
}

}  // namespace

double stated_after_move(double stated, double moved) {
  const double s = stated * stated;
  return std::sqrt(std::max(s, 0.5 * s + moved * moved));
}

SeamBackup back_up(const Lightmap& map, std::span<const uint32_t> texels) {
  SeamBackup b;
  for (size_t p = 0; p < map.planes.data.size(); ++p) {
    if (map.planes.names[p] == "error" || map.planes.names[p] == "samples") continue;
    b.planes.push_back(p);
    std::vector<float>& values = b.values.emplace_back();
    values.reserve(texels.size());
    for (const uint32_t t : texels) values.push_back(map.planes.data[p][t]);
  }
  return b;
}

void state_moves(Lightmap& map, std::span<const uint32_t> texels, const SeamBackup& before) {
  raise(map.planes.plane("error"), map, texels, before, red_planes(map, before, "E."));
  for (size_t band = 0; band < map.band_error.data.size(); ++band)
    raise(map.band_error.data[band], map, texels, before,
          red_planes(map, before, map.band_error.names[band]));
}

}  // namespace kiln
