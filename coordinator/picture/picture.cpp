#include "coordinator/picture/picture.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"

namespace kiln {

void Picture::paste(const Picture& p, uint32_t left, uint32_t top) {
  for (uint32_t y = 0; y < p.height; ++y)
    std::copy_n(p.rgb.begin() + static_cast<ptrdiff_t>(size_t{y} * p.width * 3), size_t{p.width} * 3,
                rgb.begin() + static_cast<ptrdiff_t>((size_t{y + top} * width + left) * 3));
}

Picture supersampled(uint32_t width, uint32_t height, uint32_t fine,
                     const std::function<Vec3(size_t)>& color) {
  Picture picture(width, height, 0);
  parallel_for(height, [&](size_t y) {
    for (uint32_t x = 0; x < width; ++x) {
      Vec3 sum(0.0f);
      for (uint32_t k = 0; k < fine * fine; ++k)
        sum += color((y * fine + k / fine) * width * fine + x * fine + k % fine);
      for (int c = 0; c < 3; ++c)
        picture.rgb[(y * width + x) * 3 + static_cast<size_t>(c)] =
            static_cast<uint8_t>(sum[c] / static_cast<float>(fine * fine) + 0.5f);
    }
  });
  return picture;
}

Picture page_sheet(const Lightmap& map, uint32_t size,
                   const std::function<std::array<uint8_t, 3>(size_t)>& color) {
  const uint32_t pages = map.planes.height / map.page_height;
  const uint32_t across = static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(pages))));
  const uint32_t down = (pages + across - 1) / across;
  const uint32_t full_width = across * map.planes.width, full_height = down * map.page_height;
  double step = std::max(double(full_width) / size, double(full_height) / size);
  if (step < 1) step = 1 / std::floor(1 / step);
  Picture p(std::max(1u, static_cast<uint32_t>(full_width / step)),
            std::max(1u, static_cast<uint32_t>(full_height / step)), 24);
  for (uint32_t y = 0; y < p.height; ++y)
    for (uint32_t x = 0; x < p.width; ++x) {
      const auto fx = std::min(full_width - 1, static_cast<uint32_t>((x + 0.5) * step));
      const auto fy = std::min(full_height - 1, static_cast<uint32_t>((y + 0.5) * step));
      const uint32_t page = fy / map.page_height * across + fx / map.planes.width;
      if (page >= pages) continue;
      p.set(x, y,
            color((size_t{page} * map.page_height + fy % map.page_height) * map.planes.width +
                  fx % map.planes.width));
    }
  return p;
}

}  // namespace kiln
