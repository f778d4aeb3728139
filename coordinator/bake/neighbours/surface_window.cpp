#include "coordinator/bake/neighbours/surface_window.h"

#include "common/base/check.h"

namespace kiln {
namespace {

constexpr float kMaxOff = 0.25f;  // of the radius, and of a texel
// Limit on visited sites: each found site has four neighbours and a few more at seams. With more (stacked
// slivers) the walk ends.
constexpr uint32_t kMaxLooked = 768;

}  // namespace

bool SurfaceWindow::seen(uint32_t site) {
  uint32_t at = site * 2654435769u >> 22;
  while (slots_[at].round == round_) {
    if (slots_[at].site == site) return true;
    at = (at + 1) & (kSlots - 1);
  }
  slots_[at] = {site, round_};
  return false;
}

std::span<const uint32_t> SurfaceWindow::around(uint32_t site, float radius, uint32_t most) {
  KILN_CHECK(most <= kMax);
  if (++round_ == 0) {
    slots_.fill({});
    round_ = 1;
  }
  seen(site);
  found_[0] = site;
  const Vec3 centre = sites_.position[site], normal = sites_.normal[site];
  const float size = sites_.texel_size[site], square = radius * radius, off = kMaxOff * (radius + size);
  uint32_t count = 1, looked = 1;
  for (uint32_t at = 0; at < count; ++at)
    for (const uint32_t other : links_.of(found_[at])) {
      if (count >= most || looked >= kMaxLooked) return {found_.data(), count};
      if (seen(other)) continue;
      ++looked;
      const Vec3 d = sites_.position[other] - centre;
      if (!(dot(d, d) <= square) || !(std::abs(dot(d, normal)) <= off)) continue;
      if (!(dot(normal, sites_.normal[other]) >= kMinCosine)) continue;
      if (!sizes_alike(size, sites_.texel_size[other])) continue;
      found_[count++] = other;
    }
  return {found_.data(), count};
}

}  // namespace kiln
