#include "coordinator/report/response_view.h"

#include <algorithm>
#include <cmath>

#include "coordinator/output/look/surface_look.h"

namespace kiln {
namespace {

constexpr Vec3 kNoValue(255, 0, 255);

// Pixel of a texel, 0 to 255.
class ResponsePaint {
 public:
  ResponsePaint(const Lightmap& map, const ResponseInfo& response) : map_(map) {
    for (size_t s = 0; s < response.stored.size(); ++s)
      planes_.push_back(&map.responses.plane(response_plane(response, s)));
  }
  Vec3 operator()(size_t texel) const {
    if (!is_set(map_.validity[texel])) return map_.validity[texel] == Validity::kEmpty ? Vec3(24) : kNoValue;
    if (planes_.size() == 1) return Vec3(255.0f * std::clamp((*planes_[0])[texel], 0.0f, 1.0f));
    Vec3 out(0);
    for (size_t c = 0; c < planes_.size(); ++c)
      out[static_cast<int>(c)] = 127.5f * (1.0f + std::clamp((*planes_[c])[texel], -1.0f, 1.0f));
    return out;
  }

 private:
  const Lightmap& map_;
  std::vector<const std::vector<float>*> planes_;
};

}  // namespace

Picture response_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                         const ResponseInfo& response, const View& view, uint32_t fine) {
  constexpr uint32_t kGap = 8;
  const SurfaceLook look(imported.scene, atlas, map);
  const ResponsePaint paint(map, response);
  const Picture scene = supersampled(view.width / fine, view.height / fine, fine, [&](size_t i) {
    const Fragment& f = view.fragments[i];
    if (f.inverse_depth == 0) return Vec3(40.0f);
    return look.receives(f) ? paint(look.texel(f)) : Vec3(90.0f);
  });
  const Picture sheet = page_sheet(map, scene.height, [&](size_t t) -> std::array<uint8_t, 3> {
    const Vec3 v = paint(t);
    return {static_cast<uint8_t>(v.x), static_cast<uint8_t>(v.y), static_cast<uint8_t>(v.z)};
  });
  Picture both(scene.width + kGap + sheet.width, scene.height, 16);
  both.paste(scene, 0, 0);
  both.paste(sheet, scene.width + kGap, 0);
  return both;
}

Lightmap lit_by(const Lightmap& map, const ResponseInfo& response) {
  Lightmap out;
  out.page_height = map.page_height;
  out.validity = map.validity;
  out.planes.width = map.planes.width;
  out.planes.height = map.planes.height;
  std::vector<float> grey(map.validity.size(), 0.0f);
  for (size_t s = 0; s < response.stored.size(); ++s) {
    const std::vector<float>& plane = map.responses.plane(response_plane(response, s));
    for (size_t t = 0; t < grey.size(); ++t) grey[t] += plane[t] * plane[t];
  }
  for (float& g : grey) g = std::sqrt(g);
  for (const char* plane : {"E.R", "E.G", "E.B"}) out.planes.add(plane) = grey;
  return out;
}

}  // namespace kiln
