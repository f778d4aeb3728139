// Connected surfaces: sites connected by links through known sites.
#pragma once

#include <numeric>
#include <span>
#include <vector>

#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// By site: the smallest connected site; the site itself if unknown.
inline std::vector<uint32_t> surface_pieces(std::span<const uint8_t> known, const SurfaceLinks& links) {
  std::vector<uint32_t> piece(known.size());
  std::iota(piece.begin(), piece.end(), 0u);
  const auto root = [&](uint32_t i) {
    while (piece[i] != i) i = piece[i] = piece[piece[i]];
    return i;
  };
  for (uint32_t i = 0; i < piece.size(); ++i) {
    if (!known[i]) continue;
    for (const uint32_t j : links.of(i)) {
      if (j >= i || !known[j]) continue;
      const uint32_t a = root(i), b = root(j);
      piece[std::max(a, b)] = std::min(a, b);
    }
  }
  for (uint32_t i = 0; i < piece.size(); ++i) piece[i] = root(i);
  return piece;
}

// Number of sites of each piece, stored at its smallest site; 0 elsewhere.
inline std::vector<uint32_t> piece_sizes(std::span<const uint32_t> pieces) {
  std::vector<uint32_t> size(pieces.size());
  for (const uint32_t p : pieces) ++size[p];
  return size;
}

}  // namespace kiln
