#include "tests/viewer/compare_pictures.h"

#include "common/base/files.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/preview.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln::test {
namespace {

// Whether the samples around number i lie on a surface that goes on: depths within a twentieth.
bool is_inside_surface(const View& view, size_t i) {
  const auto x = static_cast<int64_t>(i % view.width), y = static_cast<int64_t>(i / view.width);
  const float own = view.fragments[i].inverse_depth;
  if (own == 0 || x == 0 || y == 0 || x + 1 == view.width || y + 1 == view.height) return false;
  for (int64_t dy = -1; dy <= 1; ++dy)
    for (int64_t dx = -1; dx <= 1; ++dx) {
      const float other = view.fragments[static_cast<size_t>((y + dy) * view.width + x + dx)].inverse_depth;
      if (!(std::abs(other - own) <= 0.05f * own)) return false;
    }
  return true;
}

}  // namespace

Reference render_reference(const Published& p, float exposure, bool filmic) {
  ViewStyle style;
  style.exposure = exposure;
  style.filmic = filmic;
  const Camera& camera = p.imported.cameras.front();
  Reference out{render_view(p.imported, p.atlas, p.map, camera, kWidth, kHeight, style), {}};
  const SurfaceLook look(p.imported.scene, p.atlas, p.map);
  const View view = rasterise(p.imported.scene, camera, kSampledWidth, kSampledHeight,
                              [&](const Fragment& f) { return look.visible(f); });
  out.surface.assign(size_t{kWidth} * kHeight, true);
  for (size_t i = 0; i < view.fragments.size(); ++i)
    if (!is_inside_surface(view, i))
      out.surface[i / kSampledWidth / kSupersample * kWidth + i % kSampledWidth / kSupersample] = false;
  return out;
}

Difference compare_pictures(const Reference& ours, const Picture& theirs) {
  std::vector<double> all;
  for (size_t i = 0; i < ours.surface.size(); ++i) {
    if (!ours.surface[i]) continue;
    double sum = 0;
    for (size_t c = 0; c < 3; ++c)
      sum += std::abs(static_cast<double>(ours.picture.rgb[3 * i + c]) -
                      static_cast<double>(theirs.rgb[3 * i + c]));
    all.push_back(sum / 3);
  }
  Difference d{all.size(), 0, 0};
  for (const double x : all) d.mean += x / static_cast<double>(std::max<size_t>(1, all.size()));
  std::sort(all.begin(), all.end());
  if (!all.empty()) d.median = all[all.size() / 2];
  return d;
}

Picture read_sampled(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  EXPECT_TRUE(bytes) << file;
  if (!bytes) return {};
  const auto theirs = decode_image(*bytes, "screenshot");
  EXPECT_TRUE(theirs && theirs->width == kSampledWidth && theirs->height == kSampledHeight) << file;
  if (!theirs || theirs->width != kSampledWidth || theirs->height != kSampledHeight) return {};
  Picture shown = supersampled(kWidth, kHeight, kSupersample, [&](size_t i) {
    const std::byte* c = &theirs->texels[theirs->channels * i];
    return Vec3(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]));
  });
  EXPECT_TRUE(write_png(file, kWidth, kHeight, shown.rgb));
  return shown;
}

}  // namespace kiln::test
