#include "worker/materials/kept_light.h"

#include "worker/materials/bsdf.h"

namespace kiln {
namespace {

// The albedo of a rough coat exceeds F at the cosine by up to 0.0022, because F is convex and normals
// scatter: what passes on to the GGX layer leaves room for it.
constexpr float kScatterMargin = 0.0025f;

}  // namespace

KeptLight::KeptLight(const Bsdf& b)
    : under_f0_(b.under_f0), under_f90_(b.under_f90), layer_(b.has_specular()), coat_(b.coat) {
  if (layer_) base_ = GgxAlbedo(b.alpha);
  if (b.has_sheen()) {
    sheen_ = SheenAlbedo(b.sheen_roughness);
    sheen_color_ = max_component(b.sheen);
  }
  if (coat_ > 0.0f) {
    coat_albedo_ = GgxAlbedo(b.coat_alpha);
    // One way is 1 - F of the smooth coat, whatever its width, so that one table does. Both ways make its
    // square; what bounces between coat and layer at normal incidence brings that to 1 - F there.
    const float both = (1.0f - kScatterMargin * coat_) / (1.0f - kCoatF0 * coat_);
    const float scale = std::sqrt(both);
    through_ = scale * (1.0f - kCoatF0 * coat_);
    through_fifth_ = scale * (1.0f - kCoatF0) * coat_;
  }
}

auto KeptLight::rest(float all, const ByFresnel& coat, const GgxAlbedo::Means& layer) const -> Shares {
  const ByFresnel reflected = layer.plain.albedo * (through_ * through_) +
                              (layer.plain.fifth + layer.under_fifth.albedo) * (-through_ * through_fifth_) +
                              layer.under_fifth.fifth * (through_fifth_ * through_fifth_);
  return rest(all, coat_ * coat.of(kCoatF0, 1.0f), reflected);
}

auto KeptLight::under_cover(float cos) const -> Shares {
  ByFresnel reflected;
  if (layer_) reflected = base_.albedo(cos);
  if (layer_ && coat_ > 0.0f)
    reflected = (reflected * through_ + base_.fifth(cos) * -through_fifth_) * through_coat(cos);
  const Shares kept = rest(1.0f, coat(cos), reflected);
  const float under_sheen = through_sheen(cos);
  return {kept.under * under_sheen, kept.metal * under_sheen};
}

auto KeptLight::mean() const -> Shares {
  const GgxAlbedo::Means none;
  const Shares kept = rest(1.0f, coat_ > 0.0f ? coat_albedo_.means().plain.albedo : ByFresnel{},
                           layer_ ? base_.means() : none);
  if (!(sheen_color_ > 0.0f)) return kept;
  const Shares under =
      rest(sheen_.mean(), coat_ > 0.0f ? coat_albedo_.means_under(sheen_).plain.albedo : ByFresnel{},
           layer_ ? base_.means_under(sheen_) : none);
  return {kept.under - sheen_color_ * under.under, kept.metal - sheen_color_ * under.metal};
}

float KeptLight::sheen_mean() const {
  if (!(coat_ > 0.0f)) return sheen_.mean();
  return sheen_.mean() - coat_ * coat_albedo_.means_under(sheen_).plain.albedo.of(kCoatF0, 1.0f);
}

KeptLayers::KeptLayers(const Bsdf& b)
    : light(b), mean(light.mean()), base_mean(b.metallic > 0.0f ? light.base_mean() : 0.0f) {}

}  // namespace kiln
