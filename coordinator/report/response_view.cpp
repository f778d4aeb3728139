#include "coordinator/report/response_view.h"

#include <algorithm>
#include <cmath>

#include "coordinator/output/look/surface_look.h"

namespace kiln {
namespace {

// A map whose E is the stored value, one value in all three colours.
Lightmap stored_as_light(const Lightmap& map, const ResponseInfo& response) {
  Lightmap out;
  out.page_height = map.page_height;
  out.validity = map.validity;
  out.planes.width = map.planes.width;
  out.planes.height = map.planes.height;
  for (size_t c = 0; c < 3; ++c)
    out.planes.add(std::string("E.") + "RGB"[c]) =
        map.responses.plane(response_plane(response, std::min(c, response.stored.size() - 1)));
  return out;
}

// Pixel value of a stored value, 0 to 255.
Vec3 paint(const Vec3& value, const ResponseInfo& response) {
  const Vec3 shown = response.is_signed ? 0.5f + 0.5f * value : value;
  return 255.0f * glm::clamp(shown, Vec3(0), Vec3(1));
}

}  // namespace

Picture response_picture(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                         const ResponseInfo& response, const View& view, uint32_t fine) {
  constexpr uint32_t kGap = 8;
  const Lightmap shown = stored_as_light(map, response);
  const SurfaceLook look(imported.scene, atlas, shown);
  const Picture scene = supersampled(view.width / fine, view.height / fine, fine, [&](size_t i) {
    const Fragment& f = view.fragments[i];
    if (f.inverse_depth == 0) return Vec3(40);
    if (Vec3 value; look.irradiance(f, value)) return paint(value, response);
    return look.receives(f) ? Vec3(255, 0, 255) : Vec3(90);
  });
  const Picture sheet = page_sheet(map, scene.height, [&](size_t t) -> std::array<uint8_t, 3> {
    if (!is_set(map.validity[t])) return {24, 24, 24};
    const auto& e = shown.planes.data;
    const Vec3 v = paint(Vec3(e[0][t], e[1][t], e[2][t]), response);
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
