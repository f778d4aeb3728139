#include "coordinator/output/textures/levels.h"

#include <algorithm>
#include <array>

namespace kiln {
namespace {

bool is_stored(const std::string& plane) {
  return plane != "error" && plane != "samples";
}

struct Level {
  MapLevel map;
  std::vector<float> coverage;  // share of a texel covered by its chart
};

Level first_level(const Lightmap& lightmap, const Atlas& atlas) {
  Level level;
  MapLevel& m = level.map;
  m.page_height = lightmap.page_height;
  m.pages = lightmap.page_height ? lightmap.planes.height / lightmap.page_height : 0;
  m.planes.width = lightmap.planes.width;
  m.planes.height = lightmap.planes.height;
  for (size_t p = 0; p < lightmap.planes.names.size(); ++p)
    if (is_stored(lightmap.planes.names[p])) m.planes.add(lightmap.planes.names[p]) = lightmap.planes.data[p];
  const size_t count = lightmap.validity.size();
  m.weight.resize(count);
  m.owner.assign(count, 0);
  level.coverage.resize(count);
  for (size_t t = 0; t < count; ++t) {
    const bool set = is_set(lightmap.validity[t]), own = set && atlas.owner[t] != 0;
    m.weight[t] = own ? 1.0f : set ? kDilatedWeight : 0.0f;
    m.owner[t] = own ? atlas.owner[t] : 0;
    level.coverage[t] = own ? 1.0f : 0.0f;
  }
  return level;
}

// The texels of the larger level that form one of the smaller, with weights.
struct Mix {
  std::array<size_t, 4> texel{};
  std::array<float, 4> weight{};
  int count = 0;
  uint32_t owner = 0;
  float coverage = 0, worth = 0;
};

Mix mix_of(const Level& above, size_t page, uint32_t x, uint32_t y) {
  const MapLevel& m = above.map;
  Mix mix;
  std::array<size_t, 4> child{};
  int children = 0;
  for (uint32_t k = 0; k < 4; ++k) {
    const uint32_t cx = 2 * x + k % 2, cy = 2 * y + k / 2;
    if (cx < m.planes.width && cy < m.page_height)
      child[children++] = page * m.page_texels() + size_t{cy} * m.planes.width + cx;
  }
  float most = 0;
  for (int i = 0; i < children; ++i) {
    const uint32_t owner = m.owner[child[i]];
    float sum = 0;
    for (int j = 0; owner && j < children; ++j)
      if (m.owner[child[j]] == owner) sum += above.coverage[child[j]];
    if (sum > most || (sum == most && sum > 0 && owner < mix.owner)) most = sum, mix.owner = owner;
  }
  for (int i = 0; i < children; ++i) {
    const bool counts = mix.owner ? m.owner[child[i]] == mix.owner : m.weight[child[i]] > 0;
    if (!counts) continue;
    mix.texel[mix.count] = child[i];
    mix.weight[mix.count++] = mix.owner ? above.coverage[child[i]] : 1.0f;
  }
  mix.coverage = most / 4;
  mix.worth = mix.owner ? 1.0f : mix.count ? kDilatedWeight : 0.0f;
  float total = 0;
  for (int i = 0; i < mix.count; ++i) total += mix.weight[i];
  for (int i = 0; i < mix.count; ++i) mix.weight[i] /= total;
  return mix;
}

// Fills texels beside a chart with the mean of their 3x3 neighbours in charts.
void fill_ring(MapLevel& m) {
  const std::vector<uint32_t> owner = m.owner;
  for (size_t t = 0; t < owner.size(); ++t) {
    if (owner[t]) continue;
    const size_t page = t / m.page_texels(), in_page = t % m.page_texels();
    const auto x = static_cast<int64_t>(in_page % m.planes.width),
               y = static_cast<int64_t>(in_page / m.planes.width);
    std::array<size_t, 8> near{};
    int count = 0;
    for (int64_t dy = -1; dy <= 1; ++dy)
      for (int64_t dx = -1; dx <= 1; ++dx) {
        const int64_t nx = x + dx, ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= m.planes.width || ny >= m.page_height) continue;
        const size_t n = page * m.page_texels() + static_cast<size_t>(ny * m.planes.width + nx);
        if (owner[n]) near[count++] = n;
      }
    if (count == 0) continue;
    for (std::vector<float>& plane : m.planes.data) {
      float sum = 0;
      for (int k = 0; k < count; ++k) sum += plane[near[k]];
      plane[t] = sum / static_cast<float>(count);
    }
    m.weight[t] = 1;
  }
}

Level smaller(const Level& above) {
  Level level;
  MapLevel& m = level.map;
  m.pages = above.map.pages;
  m.page_height = std::max(1u, above.map.page_height / 2);
  m.planes.width = std::max(1u, above.map.planes.width / 2);
  m.planes.height = m.page_height * m.pages;
  for (const std::string& name : above.map.planes.names) m.planes.add(name);
  const size_t count = m.page_texels() * m.pages;
  m.weight.resize(count);
  m.owner.resize(count);
  level.coverage.resize(count);
  for (size_t t = 0; t < count; ++t) {
    const size_t page = t / m.page_texels(), in_page = t % m.page_texels();
    const Mix mix = mix_of(above, page, static_cast<uint32_t>(in_page % m.planes.width),
                           static_cast<uint32_t>(in_page / m.planes.width));
    m.weight[t] = mix.worth;
    m.owner[t] = mix.owner;
    level.coverage[t] = mix.coverage;
    for (size_t p = 0; p < m.planes.data.size(); ++p) {
      float sum = 0;
      for (int k = 0; k < mix.count; ++k) sum += mix.weight[k] * above.map.planes.data[p][mix.texel[k]];
      m.planes.data[p][t] = sum;
    }
  }
  return level;
}

}  // namespace

std::vector<MapLevel> map_levels(const Lightmap& map, const Atlas& atlas, uint32_t below) {
  std::vector<MapLevel> levels;
  Level level = first_level(map, atlas);
  levels.push_back(level.map);
  while (levels.size() <= below && (level.map.planes.width > 1 || level.map.page_height > 1)) {
    level = smaller(level);
    levels.push_back(level.map);
    fill_ring(levels.back());  // for lookups: the next level does not use it
  }
  return levels;
}

}  // namespace kiln
