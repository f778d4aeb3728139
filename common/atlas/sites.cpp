// Bands of rows are independent, so they run in parallel; within one everything is in (instance, face)
// order, so the result does not depend on threads.
#include "common/atlas/sites.h"

#include <bit>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/raster/coverage.h"

namespace kiln {
namespace {

constexpr uint32_t kBandRows = 16;

struct Item {
  uint32_t instance, face;
};

Triangle2 corners(const Atlas& atlas, const Item& item, uint32_t& page) {
  const MeshCharts& charts = atlas.of_instance(item.instance);
  const ChartPlacement& place =
      atlas.placements[atlas.instance_first_chart[item.instance] + charts.chart_of_face[item.face]];
  page = place.page;
  return texel_triangle(charts, place, item.face);
}

// Faces by the bands they overlap, in order.
struct Bands {
  uint32_t per_page;
  std::vector<size_t> first;
  std::vector<Item> items;
  size_t count() const { return first.size() - 1; }
};

template <class Visit>
void for_each_band(const Atlas& atlas, uint32_t per_page, const Visit& visit) {
  for (uint32_t i = 0; i < atlas.charts_of_instance.size(); ++i) {
    const size_t faces = atlas.of_instance(i).face_count();
    for (uint32_t f = 0; f < faces; ++f) {
      uint32_t page;
      const Triangle2 triangle = corners(atlas, {i, f}, page);
      if (triangle.max_y() < 0 || triangle.min_y() >= atlas.height) continue;
      const double low = std::max(0.0, triangle.min_y()),
                   high = std::min(atlas.height - 0.5, triangle.max_y());
      const uint32_t last = static_cast<uint32_t>(high) / kBandRows;
      for (uint32_t band = static_cast<uint32_t>(low) / kBandRows; band <= last; ++band)
        visit(size_t{page} * per_page + band, Item{i, f});
    }
  }
}

Bands make_bands(const Atlas& atlas) {
  Bands bands;
  bands.per_page = (atlas.height + kBandRows - 1) / kBandRows;
  bands.first.resize(size_t{atlas.pages} * bands.per_page + 1);
  for_each_band(atlas, bands.per_page, [&](size_t band, const Item&) { ++bands.first[band + 1]; });
  for (size_t b = 1; b < bands.first.size(); ++b) bands.first[b] += bands.first[b - 1];
  bands.items.resize(bands.first.back());
  std::vector<size_t> next(bands.first.begin(), bands.first.end() - 1);
  for_each_band(atlas, bands.per_page,
                [&](size_t band, const Item& item) { bands.items[next[band]++] = item; });
  return bands;
}

struct Cover {
  uint64_t mask;
  uint32_t texel;  // within the band
  Item item;
};

struct BandSites {
  std::vector<uint32_t> texel, record_words, words;
  SiteOverlap overlap;
};

// Ordered by texel, in order of items within one.
std::vector<Cover> covers_of_band(const Atlas& atlas, const Bands& bands, size_t band) {
  const uint32_t y0 = static_cast<uint32_t>(band % bands.per_page) * kBandRows;
  const TexelRect clip{0, y0, atlas.width, std::min(y0 + kBandRows, atlas.height)};
  std::vector<Cover> found;
  std::vector<uint32_t> next(size_t{atlas.width} * kBandRows + 1);
  for (size_t i = bands.first[band]; i < bands.first[band + 1]; ++i) {
    const Item& item = bands.items[i];
    uint32_t page;
    for_each_cover(corners(atlas, item, page), clip, [&](uint32_t x, uint32_t y, uint64_t mask) {
      const uint32_t texel = (y - y0) * atlas.width + x;
      found.push_back({mask, texel, item});
      ++next[texel + 1];
    });
  }
  for (size_t t = 1; t < next.size(); ++t) next[t] += next[t - 1];
  std::vector<Cover> sorted(found.size());
  for (const Cover& cover : found) sorted[next[cover.texel]++] = cover;
  return sorted;
}

void note_overlap(std::span<const Cover> covers, uint32_t texel, SiteOverlap& overlap) {
  uint64_t seen = 0, twice = 0;
  for (const Cover& c : covers) {
    twice |= seen & c.mask;
    seen |= c.mask;
  }
  overlap.covered_points += static_cast<uint64_t>(std::popcount(seen));
  if (!twice) return;
  const auto points = static_cast<uint32_t>(std::popcount(twice));
  overlap.points += points;
  if (points >= kContactPoints) ++overlap.texels;
  if (points <= overlap.worst_points) return;
  overlap.worst_points = points;
  overlap.worst_texel = texel;
  for (size_t b = 1; b < covers.size(); ++b)
    for (size_t a = 0; a < b; ++a)
      if (covers[a].mask & covers[b].mask) {
        const Item pair[2] = {covers[a].item, covers[b].item};
        for (int k = 0; k < 2; ++k) {
          overlap.instance[k] = pair[k].instance;
          overlap.face[k] = pair[k].face;
        }
        return;
      }
}

void put_mask(std::vector<uint32_t>& words, uint64_t mask) {
  words.push_back(static_cast<uint32_t>(mask));
  words.push_back(static_cast<uint32_t>(mask >> 32));
}

BandSites sites_of_band(const Atlas& atlas, const Bands& bands, size_t band) {
  BandSites sites;
  const std::vector<Cover> covers = covers_of_band(atlas, bands, band);
  const size_t page = band / bands.per_page, row = band % bands.per_page * kBandRows;
  const auto first_texel = static_cast<uint32_t>((page * atlas.height + row) * atlas.width);
  for (size_t i = 0, end; i < covers.size(); i = end) {
    uint64_t valid = 0;
    for (end = i; end < covers.size() && covers[end].texel == covers[i].texel; ++end)
      valid |= covers[end].mask;
    const uint32_t texel = first_texel + covers[i].texel;
    note_overlap({&covers[i], end - i}, texel, sites.overlap);
    const size_t begin = sites.words.size();
    put_mask(sites.words, valid);
    uint64_t open = valid;
    for (size_t k = i; k < end; ++k) {
      const uint64_t mine = covers[k].mask & open;
      open &= ~mine;
      if (!mine) continue;
      put_mask(sites.words, mine);
      sites.words.push_back(covers[k].item.instance);
      sites.words.push_back(covers[k].item.face);
    }
    sites.texel.push_back(texel);
    sites.record_words.push_back(static_cast<uint32_t>(sites.words.size() - begin));
  }
  return sites;
}

void add_overlap(SiteOverlap& sum, const SiteOverlap& band) {
  const uint64_t covered = sum.covered_points + band.covered_points;
  const uint64_t points = sum.points + band.points, texels = sum.texels + band.texels;
  if (band.worst_points > sum.worst_points) sum = band;
  sum.covered_points = covered;
  sum.points = points;
  sum.texels = texels;
}

}  // namespace

Expected<SiteOverlap> find_sites(Atlas& atlas, unsigned threads) {
  KILN_CHECK(atlas.texel_count() <= uint64_t{1} << 31);
  const Bands bands = make_bands(atlas);
  std::vector<BandSites> parts(bands.count());
  parallel_for(
      parts.size(), [&](size_t b) { parts[b] = sites_of_band(atlas, bands, b); }, threads);
  size_t texels = 0, words = 0;
  for (const BandSites& part : parts) {
    texels += part.texel.size();
    words += part.words.size();
  }
  if (words > std::numeric_limits<uint32_t>::max())
    return fail(ErrorKind::kInvalidInput,
                text("the surface points of {} texels do not fit one atlas: lower the resolution or density",
                     texels));
  TexelSites& sites = atlas.sites = {};
  sites.texel.reserve(texels);
  sites.words.reserve(words);
  sites.first_word.reserve(texels + 1);
  sites.first_word.push_back(0);
  SiteOverlap overlap;
  for (BandSites& part : parts) {
    add_overlap(overlap, part.overlap);
    sites.texel.insert(sites.texel.end(), part.texel.begin(), part.texel.end());
    sites.words.insert(sites.words.end(), part.words.begin(), part.words.end());
    for (uint32_t n : part.record_words) sites.first_word.push_back(sites.first_word.back() + n);
    part = {};
  }
  return overlap;
}

}  // namespace kiln
