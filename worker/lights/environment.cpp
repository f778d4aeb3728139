#include "worker/lights/environment.h"

#include <cstring>

#include "common/base/format.h"
#include "common/math/trig.h"
#include "worker/lights/punctual.h"

namespace kiln {

Expected<Environment> Environment::create(const Record* record, const Scene& scene,
                                          std::vector<std::string>& warnings) {
  Environment e;
  if (!record) return e;
  RecordReader r(*record);
  e.bake_ = parse_bake(r);
  const TextureUse image = r.texture("image");
  // With an image, radiance scales it and defaults to 1.
  e.constant_ = glm::max(r.vec3("radiance", Vec3(image.texture < 0 ? 0.0f : 1.0f)), Vec3(0.0f));
  const float turns = r.number("rotation", 0.0f) / 360.0f;
  e.turn_ = turns - std::floor(turns);
  for (std::string& sentence : r.unread()) warnings.push_back(std::move(sentence));
  if (e.bake_ == BakeMode::kNone) return Environment{};
  e.black_ = !(max_component(e.constant_) > 0.0f);
  if (image.texture < 0) return e;

  const Texture& t = scene.textures[image.texture];
  if (t.format != TexelFormat::kFloat32 || t.channels < 3)
    return fail(ErrorKind::kInvalidInput, text("environment image '{}' is not float RGB", t.name));
  if (t.width > 65535 || t.height > 65535)
    return fail(ErrorKind::kInvalidInput,
                text("environment image '{}' has {} x {} texels; at most 65535 a side are possible", t.name,
                     t.width, t.height));
  e.width_ = t.width;
  e.height_ = t.height;
  e.texels_.resize(size_t{t.width} * t.height);
  for (size_t i = 0; i < e.texels_.size(); ++i) {
    std::memcpy(&e.texels_[i], t.texels.data() + i * t.texel_bytes(), sizeof(Vec3));
    e.texels_[i] *= e.constant_;
    if (!is_finite(e.texels_[i]) || e.texels_[i].x < 0 || e.texels_[i].y < 0 || e.texels_[i].z < 0)
      return fail(ErrorKind::kInvalidInput,
                  text("environment image '{}' has a negative or non-finite texel", t.name));
  }
  const auto versine = [&](uint32_t rows) {  // of the angle spanned by that many rows
    const double s = std::sin(0.5 * M_PI * rows / t.height);
    return 2.0 * s * s;
  };
  e.distribution_ = ImageDistribution(t.width, t.height);
  std::vector<double> weights(t.width);
  for (uint32_t y = 0; y < t.height; ++y) {
    const bool upper = 2 * y < t.height;
    const double first = versine(upper ? y : t.height - y),
                 second = versine(upper ? y + 1 : t.height - y - 1);
    const double solid_angle = 2.0 * M_PI / t.width * std::abs(second - first);
    e.rows_.push_back(
        {static_cast<float>(first), static_cast<float>(second), static_cast<float>(solid_angle)});
    for (uint32_t x = 0; x < t.width; ++x) weights[x] = luminance(DVec3(e.texels_[size_t{y} * t.width + x]));
    e.distribution_.add_row(weights, solid_angle);
  }
  e.distribution_.finish();
  e.black_ = e.distribution_.empty();
  return e;
}

uint32_t Environment::texel_of(const Vec3& d) const {
  if (!width_) return 0;
  // The image's middle column is +x and u grows towards +z (as Blender and three.js have it).
  float u = atan2_turns(d.z, d.x) + 0.5f + turn_;
  u -= std::floor(u);
  const float v = 2.0f * atan2_turns(std::sqrt(d.x * d.x + d.z * d.z), d.y);
  const uint32_t x = std::min(static_cast<uint32_t>(u * static_cast<float>(width_)), width_ - 1);
  const uint32_t y = std::min(static_cast<uint32_t>(v * static_cast<float>(height_)), height_ - 1);
  return y * width_ + x;
}

float Environment::pdf(uint32_t texel) const {
  if (!wants_sampling()) return 0.0f;
  const uint32_t x = texel % width_, y = texel / width_;
  return distribution_.probability(x, y) / rows_[y].solid_angle;
}

void Environment::sample(const float* u, const float* v, size_t count, LightSample* samples) const {
  ImageDistribution::Draw draws[kMax];
  distribution_.sample(u, v, count, draws);
  for (size_t k = 0; k < count; ++k) __builtin_prefetch(&texels_[size_t{draws[k].y} * width_ + draws[k].x]);
  for (size_t k = 0; k < count; ++k) {
    const ImageDistribution::Draw& at = draws[k];
    const Row& row = rows_[at.y];
    const float h = row.first + (row.second - row.first) * at.within.y;
    const float sine = std::sqrt(std::max(0.0f, h * (2.0f - h)));
    const float turns = (static_cast<float>(at.x) + at.within.x) / static_cast<float>(width_);
    const SinCos a = sincos_turns(turns - 0.5f - turn_);
    LightSample& s = samples[k];
    s = {};
    s.direction = Vec3(sine * a.cos, 2 * at.y < height_ ? 1.0f - h : h - 1.0f, sine * a.sin);
    s.far = true;
    s.pdf = at.probability / row.solid_angle;
    if (s.pdf > 0.0f) s.weight = texels_[size_t{at.y} * width_ + at.x] / s.pdf;
    s.indirect_only = indirect_only();
  }
}

}  // namespace kiln
