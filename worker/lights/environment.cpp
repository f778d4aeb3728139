#include "worker/lights/environment.h"

#include <cstring>

#include "common/base/format.h"
#include "common/math/warp.h"
#include "worker/lights/punctual.h"

namespace kiln {

Expected<Environment> Environment::create(const Record* record, const Scene& scene,
                                          std::vector<std::string>& warnings) {
  Environment e;
  if (!record) return e;
  RecordReader r(*record);
  e.bake_ = parse_bake(r);
  const TextureUse image = r.texture("image");
  // With an image the radiance scales it, and is 1 where nothing is said.
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
  e.width_ = t.width;
  e.height_ = t.height;
  e.texels_.resize(size_t{t.width} * t.height);
  for (size_t i = 0; i < e.texels_.size(); ++i) {
    std::memcpy(&e.texels_[i], t.texels.data() + i * t.texel_bytes(), sizeof(Vec3));
    e.texels_[i] *= e.constant_;
    if (!is_finite(e.texels_[i]) || e.texels_[i].x < 0 || e.texels_[i].y < 0 || e.texels_[i].z < 0)
      return fail(ErrorKind::kInvalidInput,
                  text("environment image '{}' has a texel that is no radiance", t.name));
  }
  for (uint32_t y = 0; y <= t.height; ++y)
    e.row_cos_.push_back(sincos_turns(0.5f * static_cast<float>(y) / static_cast<float>(t.height)).cos);
  std::vector<double> row_weight(t.height), weights(t.width);
  for (uint32_t y = 0; y < t.height; ++y) {
    for (uint32_t x = 0; x < t.width; ++x) weights[x] = luminance(e.texels_[size_t{y} * t.width + x]);
    e.columns_.emplace_back(weights);
    row_weight[y] = e.columns_.back().total() * (e.row_cos_[y] - e.row_cos_[y + 1]);
  }
  e.rows_ = DiscreteDistribution(row_weight);
  e.black_ = !(e.rows_.total() > 0);
  return e;
}

size_t Environment::texel_of(const Vec3& d) const {
  // The image's middle column is +x and u grows towards +z (as Blender and three.js have it).
  float u = atan2_turns(d.z, d.x) + 0.5f + turn_;
  u -= std::floor(u);
  const float v = 2.0f * atan2_turns(std::sqrt(d.x * d.x + d.z * d.z), d.y);
  const uint32_t x = std::min(static_cast<uint32_t>(u * static_cast<float>(width_)), width_ - 1);
  const uint32_t y = std::min(static_cast<uint32_t>(v * static_cast<float>(height_)), height_ - 1);
  return size_t{y} * width_ + x;
}

Vec3 Environment::radiance(const Vec3& d) const {
  return width_ ? texels_[texel_of(d)] : constant_;
}

float Environment::pdf(const Vec3& d) const {
  if (!wants_sampling()) return 0.0f;
  const size_t i = texel_of(d);
  const uint32_t x = static_cast<uint32_t>(i % width_), y = static_cast<uint32_t>(i / width_);
  const float solid_angle = 2.0f * kPi / static_cast<float>(width_) * (row_cos_[y] - row_cos_[y + 1]);
  return rows_.probability(y) * columns_[y].probability(x) / solid_angle;
}

LightSample Environment::sample(const Vec2& u) const {
  const auto row = rows_.sample(u.x);
  const auto column = columns_[row.index].sample(u.y);
  const float y = row_cos_[row.index] + (row_cos_[row.index + 1] - row_cos_[row.index]) * row.remainder;
  const float turns = (static_cast<float>(column.index) + column.remainder) / static_cast<float>(width_);
  const Vec3 local = spherical(y, turns - 0.5f - turn_);  // (cos, sin, y)
  LightSample s;
  s.direction = Vec3(local.x, local.z, local.y);
  s.far = true;
  const float solid_angle =
      2.0f * kPi / static_cast<float>(width_) * (row_cos_[row.index] - row_cos_[row.index + 1]);
  s.pdf = rows_.probability(row.index) * columns_[row.index].probability(column.index) / solid_angle;
  if (s.pdf > 0.0f) s.weight = texels_[size_t{row.index} * width_ + column.index] / s.pdf;
  s.indirect_only = indirect_only();
  return s;
}

}  // namespace kiln
