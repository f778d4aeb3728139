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
  const Pushed::Kind own = pushed(picker, index, rays).kind;
  if (own <= Pushed::kOutside) return std::nullopt;
  const auto place = [&](uint32_t point, bool moved) {
    const SitePick site = picker.at(point);
    Place out{surfaces_.at(site.instance, site.triangle, site.b1, site.b2), moved};
    if (moved) out.point.position = pushed(picker, point, rays).place;
    return out;
  };
  const uint32_t asked = std::min(picker.count(), kAsked), first = index * asked / picker.count();
  for (const Pushed::Kind wanted : {Pushed::kOpen, Pushed::kMoved, Pushed::kOutside}) {
    if (own == wanted) return place(index, wanted == Pushed::kMoved);
    for (uint32_t step = 0; step < asked && !hopeless_; ++step) {
      const uint32_t other = (first + step) % asked * picker.count() / asked;
      if (pushed(picker, other, rays).kind == wanted) return place(other, wanted == Pushed::kMoved);
    }
  }
  hopeless_ = true;
  return std::nullopt;
}

}  // namespace kiln
