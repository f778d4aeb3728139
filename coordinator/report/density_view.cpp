#include "coordinator/report/density_view.h"

#include <algorithm>
#include <array>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/bake/plan/objects.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/picture/label.h"
#include "coordinator/picture/ramp.h"

namespace kiln {
namespace {

constexpr uint32_t kScaleHeight = 56;
const Vec3 kBackground(24), kNoTexels(96), kWords(230);

// One subsample of a pixel.
struct Sample {
  bool surface = false;
  float density = 0;  // texels per metre; 0: none
  float light = 1;
};

// A logarithmic scale in powers of two.
struct Scale {
  double low = 1, high = 2;  // texels per metre

  Vec3 color(double density) const {
    return ramp(static_cast<float>(std::log2(density / low) / std::log2(high / low)));
  }
};

// The scene's own density is a tick; the ends leave 2 % of the visible samples outside on each side.
Scale scale_of(const std::vector<Sample>& samples, double density) {
  constexpr double kMaxOctaves = 8;
  std::vector<float> seen;
  for (const Sample& s : samples)
    if (s.density > 0) seen.push_back(s.density);
  if (seen.empty()) return {density / 2, density * 2};
  std::sort(seen.begin(), seen.end());
  const auto at = [&](double q) {
    return double{seen[static_cast<size_t>(q * static_cast<double>(seen.size() - 1))]};
  };
  // Rounding charts to whole texels changes densities by a fifth of an octave.
  const double low = std::floor(std::log2(at(0.02) / density) + 0.2);
  const double high = std::ceil(std::log2(at(0.98) / density) - 0.2);
  return {density * std::exp2(std::clamp(low, -kMaxOctaves, -1.0)),
          density * std::exp2(std::clamp(high, 1.0, kMaxOctaves))};
}

class Shader {
 public:
  Shader(const ImportResult& imported, const Atlas& atlas, const Camera& camera, uint32_t height)
      : scene_(imported.scene),
        atlas_(atlas),
        lookup_(atlas),
        camera_(camera),
        focal_(0.5 * height / std::tan(0.5 * double{camera.vertical_fov})) {}

  Sample at(const Fragment& f) const {
    Sample s;
    if (f.inverse_depth == 0) return s;
    s.surface = true;
    const float cosine = facing(f);
    if (lookup_.holds(f.instance, f.triangle)) {
      double b1 = f.b1, b2 = f.b2;
      const uint32_t face = lookup_.face_at(f.instance, f.triangle, b1, b2);
      s.density = static_cast<float>(face_density(scene_, atlas_, f.instance, face));
    }
    s.light = 0.45f + 0.55f * cosine;
    if (!(s.density > 0)) return s;
    const DVec2 texel = lookup_.at(f.instance, f.triangle, f.b1, f.b2).texels;
    const double pixels = focal_ * f.inverse_depth / s.density * std::sqrt(double{cosine});  // texel side
    const double shown = std::clamp((pixels - 3) / 5, 0.0, 1.0);
    const bool odd =
        (static_cast<int64_t>(std::floor(texel.x)) + static_cast<int64_t>(std::floor(texel.y))) & 1;
    if (odd) s.light *= static_cast<float>(1 - 0.4 * shown);
    return s;
  }

 private:
  // Cosine between the face normal and the direction to the eye.
  float facing(const Fragment& f) const {
    const Instance& instance = scene_.instances[f.instance];
    const Mesh& mesh = scene_.meshes[instance.mesh];
    const UVec3& t = mesh.triangles[f.triangle];
    Vec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = transform_point(instance.to_world, mesh.positions[t[k]]);
    const Vec3 normal = normalize_or(cross(p[1] - p[0], p[2] - p[0]), Vec3(0, 1, 0));
    const Vec3 point = p[0] + (p[1] - p[0]) * f.b1 + (p[2] - p[0]) * f.b2;
    return std::abs(dot(normal, normalize_or(camera_.to_world[3] - point, normal)));
  }

  const Scene& scene_;
  const Atlas& atlas_;
  AtlasLookup lookup_;
  const Camera& camera_;
  double focal_;  // pixels
};

std::array<uint8_t, 3> bytes_of(const Vec3& color) {
  std::array<uint8_t, 3> bytes;
  for (int c = 0; c < 3; ++c) bytes[static_cast<size_t>(c)] = static_cast<uint8_t>(color[c] + 0.5f);
  return bytes;
}

void draw_scale(Picture& picture, const Scale& scale, uint32_t top) {
  constexpr uint32_t kZoom = 2, kLeft = 16;
  const std::string unit = "texels per metre";
  if (picture.width < label_width(kZoom, unit) + 48 + 64 + kLeft) return;
  const uint32_t right = picture.width - 48 - label_width(kZoom, unit);
  for (uint32_t x = kLeft; x < right; ++x) {
    const double t = static_cast<double>(x - kLeft) / (right - 1 - kLeft);
    for (uint32_t y = top + 8; y < top + 26; ++y) picture.set(x, y, bytes_of(ramp(static_cast<float>(t))));
  }
  const auto octaves = static_cast<uint32_t>(std::lround(std::log2(scale.high / scale.low)));
  for (uint32_t k = 0; k <= octaves; ++k) {
    const uint32_t x = kLeft + (right - 1 - kLeft) * k / octaves;
    for (uint32_t y = top + 4; y < top + 30; ++y) picture.set(x, y, bytes_of(kWords));
    const std::string number = text("{:.3g}", scale.low * std::exp2(k));
    const uint32_t half = label_width(kZoom, number) / 2;
    draw_label(picture, x > half + 2 ? x - half : 2, top + 34, kZoom, number, bytes_of(kWords));
  }
  draw_label(picture, right + 32, top + 10, kZoom, unit, bytes_of(kWords));
}

// Density that the layout was made with; for the file's own atlas, its overall density.
double scene_density(const ImportResult& imported, const Atlas& atlas) {
  if (atlas.packed && atlas.statistics.texels_per_metre > 0) return atlas.statistics.texels_per_metre;
  double area = 0, texels = 0;
  for (const ObjectPlan& o : plan_objects(imported.scene, atlas, {})) {
    area += o.square_metres;
    texels += o.square_metres * o.texels_per_metre * o.texels_per_metre;
  }
  return area > 0 && texels > 0 ? std::sqrt(texels / area) : 1.0;
}

}  // namespace

Lightmap unbaked_lightmap(const Atlas& atlas) {
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  for (const char* name : {"E.R", "E.G", "E.B"}) map.planes.add(name);
  map.validity.assign(atlas.texel_count(), Validity::kEmpty);
  for (const uint32_t texel : atlas.sites.texel) {
    map.validity[texel] = Validity::kMeasured;
    for (auto& plane : map.planes.data) plane[texel] = 1;
  }
  return map;
}

Picture density_view(const ImportResult& imported, const Atlas& atlas, const Camera& camera, uint32_t width,
                     uint32_t height) {
  const Lightmap none;  // only materials are needed
  const SurfaceLook look(imported.scene, atlas, none);
  const View view = rasterise(imported.scene, camera, width * kSupersample, height * kSupersample,
                              [&](const Fragment& f) { return look.visible(f); });
  return density_picture(imported, atlas, camera, view, kSupersample);
}

Picture density_picture(const ImportResult& imported, const Atlas& atlas, const Camera& camera,
                        const View& view, uint32_t fine) {
  const uint32_t width = view.width / fine, height = view.height / fine;
  const Shader shader(imported, atlas, camera, view.height);
  std::vector<Sample> samples(view.fragments.size());
  parallel_for(view.height, [&](size_t y) {
    for (size_t x = 0; x < view.width; ++x)
      samples[y * view.width + x] = shader.at(view.fragments[y * view.width + x]);
  });
  const Scale scale = scale_of(samples, scene_density(imported, atlas));
  Picture picture(width, height + kScaleHeight, static_cast<uint8_t>(kBackground.x));
  picture.paste(supersampled(width, height, fine,
                             [&](size_t pixel) {
                               const Sample& s = samples[pixel];
                               return !s.surface
                                          ? kBackground
                                          : (s.density > 0 ? scale.color(s.density) : kNoTexels) * s.light;
                             }),
                0, 0);
  draw_scale(picture, scale, height);
  return picture;
}

}  // namespace kiln
