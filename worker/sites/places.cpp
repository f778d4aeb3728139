#include "worker/sites/places.h"

namespace kiln {

SurfacePoint SitePlaces::at(SitePicker& picker, uint32_t index) const {
  const SitePick site = picker.at(index);
  return surfaces_.at(site.instance, site.triangle, site.b1, site.b2);
}

Side SitePlaces::side(SitePicker& picker, uint32_t index, uint64_t& rays) {
  side_.resize(picker.count());
  if (!side_[index]) side_[index] = side_of(surfaces_, tracer_, at(picker, index), rays);
  return *side_[index];
}

const std::optional<Vec3>& SitePlaces::moved(SitePicker& picker, uint32_t index, uint64_t& rays) {
  moved_.resize(picker.count());
  if (moved_[index]) return *moved_[index];
  const SitePick site = picker.at(index);
  const double texels = picker.twice_texel_area();
  Vec3 corners[3];
  surfaces_.corners(site.instance, site.triangle, corners);
  const float area = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
  const float size = texels > 0 ? std::sqrt(static_cast<float>(double{area} / texels)) : 0.0f;
  return moved_[index].emplace(way_out(surfaces_, tracer_, at(picker, index), size, rays));
}

std::optional<SitePlaces::Place> SitePlaces::instead_of(SitePicker& picker, uint32_t index, uint64_t& rays) {
  if (hopeless_ || side(picker, index, rays) != Side::kInside) return std::nullopt;
  const uint32_t count = picker.count(), asked = std::min(count, kAsked), first = index * asked / count;
  const auto other = [&](uint32_t step) { return (first + step) % asked * count / asked; };
  const auto look_for = [&](Side wanted) -> std::optional<Place> {
    for (uint32_t step = 0; step < asked; ++step)
      if (side(picker, other(step), rays) == wanted) return Place{at(picker, other(step)), false};
    return std::nullopt;
  };
  if (const auto open = look_for(Side::kOpen)) return open;
  // The same few for every point, so that all agree whether any is usable.
  const uint32_t few = std::min(asked, kMoved), nearest = first * few / asked;
  for (uint32_t k = 0; k < few; ++k) {
    const uint32_t from = (nearest + k) % few * asked / few * count / asked;
    if (side(picker, from, rays) != Side::kInside) continue;
    if (const std::optional<Vec3>& place = moved(picker, from, rays)) {
      Place out{at(picker, from), true};
      out.point.position = *place;
      return out;
    }
  }
  if (const auto outside = look_for(Side::kOutside)) return outside;
  hopeless_ = true;
  return std::nullopt;
}

}  // namespace kiln
