#include "coordinator/output/look/surface_look.h"

#include <cstring>

#include "common/math/trig.h"
#include "common/scene/record_reader.h"

namespace kiln {
namespace {

// The texel of a row or column of `size`, by the sampler's rule beyond the edges.
uint32_t wrapped(int64_t i, uint32_t size, Wrap mode) {
  const int64_t n = size;
  if (mode == Wrap::kClamp) return static_cast<uint32_t>(std::clamp<int64_t>(i, 0, n - 1));
  const int64_t period = mode == Wrap::kMirror ? 2 * n : n;
  const int64_t in = ((i % period) + period) % period;
  return static_cast<uint32_t>(in < n ? in : period - 1 - in);
}

// Linear; grey is repeated, missing alpha is 1.
Vec4 texel_of(const Texture& t, uint32_t x, uint32_t y) {
  const size_t i = (size_t{y} * t.width + x) * t.channels;
  float c[4] = {0, 0, 0, 1};
  for (uint32_t k = 0; k < t.channels; ++k) {
    if (t.format == TexelFormat::kFloat32) {
      std::memcpy(&c[k], t.texels.data() + 4 * (i + k), 4);
      continue;
    }
    const auto byte = static_cast<uint8_t>(t.texels[i + k]);
    const bool alpha = (t.channels == 4 && k == 3) || (t.channels == 2 && k == 1);
    c[k] =
        t.format == TexelFormat::kSrgb8 && !alpha ? srgb8_to_linear(byte) : static_cast<float>(byte) / 255.0f;
  }
  if (t.channels == 1) return {c[0], c[0], c[0], 1};
  if (t.channels == 2) return {c[0], c[0], c[0], c[1]};
  return {c[0], c[1], c[2], c[3]};
}

// Bilinear, as engines filter it from near, unless the sampler asks for the nearest texel.
Vec4 lookup(const Texture& t, float u, float v) {
  constexpr float kFar = 1e4f;  // beyond it a float does not resolve texels
  if (!(std::abs(u) < kFar)) u = 0;
  if (!(std::abs(v) < kFar)) v = 0;
  const float x = u * static_cast<float>(t.width), y = v * static_cast<float>(t.height);
  const auto at = [&](float column, float row) {
    return texel_of(t, wrapped(static_cast<int64_t>(column), t.width, t.wrap_s),
                    wrapped(static_cast<int64_t>(row), t.height, t.wrap_t));
  };
  if (t.nearest) return at(std::floor(x), std::floor(y));
  const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
  const float a = x - 0.5f - left, b = y - 0.5f - top;
  const Vec4 upper = at(left, top) * (1 - a) + at(left + 1, top) * a;
  const Vec4 lower = at(left, top + 1) * (1 - a) + at(left + 1, top + 1) * a;
  return upper * (1 - b) + lower * b;
}

}  // namespace

SurfaceLook::SurfaceLook(const Scene& scene, const Atlas& atlas, const Lightmap& map, bool textures)
    : scene_(scene), atlas_(atlas), lookup_(atlas), map_(map), textures_(textures) {
  for (const Record& record : scene.materials) {
    RecordReader r(record);
    Look look;
    look.color = r.vec4("base_color", Vec4(1.0f));
    look.color_texture = r.texture("base_color_texture");
    look.emission = r.vec3("emission", Vec3(0.0f));
    look.emission_texture = r.texture("emission_texture");
    const std::string mode = r.word("alpha_mode", "opaque");
    look.opaque = mode == "opaque";
    look.blended = mode == "blend";
    look.cutoff = mode == "mask" ? r.number("alpha_cutoff", 0.5f) : 0.5f;
    look.double_sided = r.number("double_sided", 0) != 0;
    look.unlit = record.type == "unlit";
    looks_.push_back(look);
  }
  for (const Record& light : scene.lights)
    if (light.type == "environment") environment_ = &light;
}

Vec2 SurfaceLook::interpolate(const std::vector<Vec2>& values, const Fragment& f) const {
  if (values.empty()) return Vec2(0.0f);
  const UVec3& t = scene_.meshes[scene_.instances[f.instance].mesh].triangles[f.triangle];
  return values[t.x] * (1.0f - f.b1 - f.b2) + values[t.y] * f.b1 + values[t.z] * f.b2;
}

Vec4 SurfaceLook::texture(const TextureUse& use, const Fragment& f) const {
  if (use.texture < 0 || !textures_) return Vec4(1.0f);
  const Vec2 uv = interpolate(scene_.meshes[scene_.instances[f.instance].mesh].uv[use.uv_set], f);
  return lookup(scene_.textures[use.texture], use.m[0] * uv.x + use.m[1] * uv.y + use.m[2],
                use.m[3] * uv.x + use.m[4] * uv.y + use.m[5]);
}

Vec4 SurfaceLook::base_color(const Fragment& f) const {
  const Look& look = looks_[scene_.instances[f.instance].material];
  return look.color * texture(look.color_texture, f);
}

Vec3 SurfaceLook::emission(const Fragment& f) const {
  const Look& look = looks_[scene_.instances[f.instance].material];
  if (look.unlit) return Vec3(base_color(f));
  return look.emission * Vec3(texture(look.emission_texture, f));
}

bool SurfaceLook::visible(const Fragment& f) const {
  const Look& look = looks_[scene_.instances[f.instance].material];
  return (!f.back || look.double_sided) && solid(f);
}

bool SurfaceLook::solid(const Fragment& f) const {
  const Look& look = looks_[scene_.instances[f.instance].material];
  return look.opaque || base_color(f).w >= look.cutoff;
}

bool SurfaceLook::is_veil(const Fragment& f) const {
  const Look& look = looks_[scene_.instances[f.instance].material];
  return look.blended && (!f.back || look.double_sided) && !solid(f);
}

bool SurfaceLook::has_veils() const {
  return std::any_of(looks_.begin(), looks_.end(), [](const Look& look) { return look.blended; });
}

Vec2 SurfaceLook::texel_coordinates(const Fragment& f, uint32_t& page) const {
  const AtlasPlace place = lookup_.at(f.instance, f.triangle, f.b1, f.b2);
  page = place.page;
  return Vec2(place.texels);
}

size_t SurfaceLook::texel(const Fragment& f) const {
  uint32_t page;
  const Vec2 c = texel_coordinates(f, page);
  const float x = std::clamp(c.x, 0.0f, static_cast<float>(atlas_.width - 1));
  const float y = std::clamp(c.y, 0.0f, static_cast<float>(atlas_.height - 1));
  return (size_t{page} * atlas_.height + static_cast<size_t>(y)) * atlas_.width + static_cast<size_t>(x);
}

bool SurfaceLook::irradiance(const Fragment& f, Vec3& e) const {
  if (!receives(f)) return false;
  uint32_t page;
  const Vec2 texels = texel_coordinates(f, page);
  return irradiance_at(page, texels, e);
}

bool SurfaceLook::irradiance_at(uint32_t page, const Vec2& texels, Vec3& e) const {
  const Vec2 c = texels - 0.5f;
  const float fx = std::floor(c.x), fy = std::floor(c.y);
  const float weight_x[2] = {1.0f - (c.x - fx), c.x - fx}, weight_y[2] = {1.0f - (c.y - fy), c.y - fy};
  e = Vec3(0.0f);
  float total = 0;
  for (int k = 0; k < 4; ++k) {
    const float x = std::clamp(fx + static_cast<float>(k & 1), 0.0f, static_cast<float>(atlas_.width - 1));
    const float y = std::clamp(fy + static_cast<float>(k >> 1), 0.0f, static_cast<float>(atlas_.height - 1));
    const size_t t =
        (size_t{page} * atlas_.height + static_cast<size_t>(y)) * atlas_.width + static_cast<size_t>(x);
    if (!is_set(map_.validity[t])) continue;
    const float w = weight_x[k & 1] * weight_y[k >> 1];
    e += Vec3(map_.planes.data[0][t], map_.planes.data[1][t], map_.planes.data[2][t]) * w;
    total += w;
  }
  if (total <= 1e-4f) return false;
  e /= total;
  return true;
}

Vec3 SurfaceLook::sky(const Vec3& d) const {
  if (!environment_) return Vec3(0.0f);
  RecordReader r(*environment_);
  const TextureUse image = r.texture("image");
  if (image.texture < 0) return r.vec3("radiance", Vec3(0.0f));
  const float u = atan2_turns(d.z, d.x) + 0.5f + r.number("rotation", 0.0f) / 360.0f;
  const float v = 2.0f * atan2_turns(std::sqrt(d.x * d.x + d.z * d.z), d.y);
  return Vec3(lookup(scene_.textures[image.texture], u, std::min(v, 0.99999f))) *
         r.vec3("radiance", Vec3(1.0f));
}

}  // namespace kiln
