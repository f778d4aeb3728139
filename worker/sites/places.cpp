#include "worker/sites/places.h"

namespace kiln {

const Pushed& SitePlaces::pushed(SitePicker& picker, uint32_t index, uint64_t& rays) {
  found_.resize(picker.count());
  if (found_[index]) return *found_[index];
  const SitePick site = picker.at(index);
  const double texels = picker.twice_texel_area();
  Vec3 corners[3];
  surfaces_.corners(site.instance, site.triangle, corners);
  const float area = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
  const float size = texels > 0 ? std::sqrt(static_cast<float>(double{area} / texels)) : 0.0f;
  const SurfacePoint at = surfaces_.at(site.instance, site.triangle, site.b1, site.b2);
  return found_[index].emplace(push_out(surfaces_, tracer_, at, size, rays));
}

std::optional<SitePlaces::Place> SitePlaces::instead_of(SitePicker& picker, uint32_t index, uint64_t& rays) {
  if (hopeless_ || pushed(picker, index, rays).kind <= Pushed::kOutside) return std::nullopt;
  for (const Pushed::Kind wanted : {Pushed::kOpen, Pushed::kMoved, Pushed::kOutside})
    for (uint32_t step = 0; step < picker.count(); ++step) {
      const uint32_t other = (index + step) % picker.count();
      const Pushed& to = pushed(picker, other, rays);
      if (to.kind != wanted) continue;
      const SitePick site = picker.at(other);
      Place place{surfaces_.at(site.instance, site.triangle, site.b1, site.b2), wanted == Pushed::kMoved};
      if (place.moved) place.point.position = to.place;
      return place;
    }
  hopeless_ = true;
  return std::nullopt;
}

}  // namespace kiln
